// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "gil.hpp"

#include <cassert>
#include <utility>

namespace loopbit::python {
namespace {

/// The state of this thread while it does not hold the GIL; otherwise null.
thread_local PyThreadState* waiting = nullptr;

void give_up() {
  assert(!waiting);
  waiting = PyEval_SaveThread();
}

void take_back() {
  PyThreadState* const state = std::exchange(waiting, nullptr);
  unless_ended([&] { PyEval_RestoreThread(state); });
}

}  // namespace

WithoutGil::WithoutGil() { give_up(); }
WithoutGil::~WithoutGil() { take_back(); }

WithGil::WithGil() : took_(waiting != nullptr) {
  if (took_) take_back();
}
WithGil::~WithGil() {
  if (took_) give_up();
}

}  // namespace loopbit::python
