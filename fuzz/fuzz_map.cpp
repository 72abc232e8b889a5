// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/map_file.hpp"
#include "loopbit/map_tools.hpp"

#include "fuzz_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  loopbit::fuzz::read_as_file(data, size, ".db", [](const std::string& path) {
    (void)loopbit::check_map(path);
    loopbit::MapReader map(path);
    map.for_each_earlier_place([](const auto&, const auto&) {});
    (void)map.images();
    (void)loopbit::export_loops(map, loopbit::ExportFormat::json);
    (void)loopbit::export_loops(map, loopbit::ExportFormat::g2o);
    (void)map.odometry();
    (void)map.options();
  });
  return 0;
}
