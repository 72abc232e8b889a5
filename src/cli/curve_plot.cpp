// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "curve_plot.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "loopbit/printable.hpp"

namespace loopbit::cli {
namespace {

// Pixels.
constexpr int kSide = 320;  ///< of the square between the axes
constexpr int kLeft = 54;
constexpr int kTop = 16;
constexpr int kBottom = 46;
constexpr int kRight = 24;
constexpr int kRow = 20;       ///< of the legend
constexpr int kLine = 28;      ///< the sample of a curve in the legend
constexpr int kCharacter = 8;  ///< at most, on average

/// Okabe and Ito's colours, which everybody can tell apart on white, and dashes for when they
/// repeat.
constexpr std::array<const char*, 7> kColours{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                              "#000000", "#e69f00", "#56b4e9"};
constexpr std::array<const char*, 4> kDashes{"none", "6 3", "2 2", "8 3 2 3"};

std::string escaped(const std::string& name) {
  std::string text;
  for (const char c : printable(name)) {
    if (c == '&' || c == '<') {
      text += c == '&' ? "&amp;" : "&lt;";
    } else {
      text += c;
    }
  }
  return text;
}

std::string at(double recall, double precision) {
  return fmt::format("{:.1f},{:.1f}", kLeft + recall * kSide, kTop + (1 - precision) * kSide);
}

std::string stroke(std::size_t run) {
  return fmt::format(R"(stroke="{}" stroke-dasharray="{}")", kColours[run % kColours.size()],
                     kDashes[run / kColours.size() % kDashes.size()]);
}

std::string axes() {
  std::string svg;
  for (int tenths = 0; tenths <= 10; tenths += 2) {
    const double share = tenths / 10.0;
    svg += fmt::format(
        "<polyline points=\"{} {}\" stroke=\"#ddd\"/><polyline points=\"{} {}\" stroke=\"#ddd\"/>\n"
        "<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{:.1f}</text>"
        "<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{:.1f}</text>\n",
        at(share, 0), at(share, 1), at(0, share), at(1, share), kLeft + share * kSide,
        kTop + kSide + 18, share, kLeft - 8, kTop + (1 - share) * kSide + 4, share);
  }
  svg += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" stroke=\"#666\"/>\n",
                     kLeft, kTop, kSide, kSide);
  svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">recall</text>\n",
                     kLeft + kSide / 2, kTop + kSide + 38);
  svg += fmt::format(
      "<text transform=\"translate(14 {}) rotate(-90)\" text-anchor=\"middle\">precision</text>\n",
      kTop + kSide / 2);
  return svg;
}

/// Points closer than a tenth of a pixel are one.
std::string curve(const Evaluation& evaluation, std::size_t run) {
  std::string points;
  std::string last;
  for (const CurvePoint& point : evaluation.curve) {
    if (point.right + point.wrong == 0) continue;
    const std::string here = at(point.recall, point.precision);
    if (here == last) continue;
    points += (points.empty() ? "" : " ") + here;
    last = here;
  }
  const DecisionCounts& decision = evaluation.decision;
  return fmt::format(
      "<polyline points=\"{}\" {} stroke-width=\"2\"/>\n"
      "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\" stroke=\"#fff\"/>\n",
      points, stroke(run), kLeft + decision.recall() * kSide,
      kTop + (1 - decision.precision()) * kSide, kColours[run % kColours.size()]);
}

}  // namespace

std::string curve_plot(const std::vector<NamedEvaluation>& runs) {
  std::size_t longest = 0;
  std::string drawn = axes();
  for (std::size_t run = 0; run < runs.size(); ++run) {
    drawn += curve(runs[run].evaluation, run);
    const int x = kLeft + kSide + kRight;
    const int y = kTop + kRow / 2 + static_cast<int>(run) * kRow;
    drawn += fmt::format(
        "<polyline points=\"{},{} {},{}\" {} stroke-width=\"2\"/><text x=\"{}\" "
        "y=\"{}\">{}</text>\n",
        x, y, x + kLine, y, stroke(run), x + kLine + 8, y + 4, escaped(runs[run].name));
    longest = std::max(longest, runs[run].name.size());
  }
  const int legend = kLine + 8 + static_cast<int>(longest) * kCharacter;
  const int width = kLeft + kSide + kRight + legend;
  const int height = kTop + std::max(kSide + kBottom, static_cast<int>(runs.size()) * kRow + kTop);
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" "
      "viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" font-size=\"12\" fill=\"#333\">\n"
      "<title>Precision and recall; a dot marks the detector's own decision</title>\n"
      "<style>polyline, rect {{ fill: none }}</style>\n"
      "<path d=\"M0 0H{0}V{1}H0Z\" fill=\"#fff\"/>\n{2}</svg>\n",
      width, height, drawn);
}

void add_plot_flag(CLI::App& command, std::string& file) {
  command.add_option("--plot", file, "Draw the precision-recall curve to this file, as SVG")
      ->type_name("FILE.svg");
}

}  // namespace loopbit::cli
