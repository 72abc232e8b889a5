// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <thread>

#include <pybind11/pybind11.h>

namespace loopbit::python {

// Handling of the GIL. While the interpreter ends, other threads cannot acquire it. Before
// Python 3.14 such a thread is ended by unwinding its stack. C++ destructors would then run without
// the GIL, and the first noexcept function would abort the process. Here such a thread blocks
// forever instead, as in Python 3.14. Therefore only these functions acquire the GIL or call Python
// code of the user.

/// Returns the result of `call`, a call of Python's C functions. Never returns if Python ends this
/// thread there.
template <typename Call>
auto unless_ended(const Call& call) {
  try {
    return call();
  } catch (...) {  // C throws nothing else
    while (true) std::this_thread::sleep_for(std::chrono::hours(1));
  }
}

/// Releases the GIL during its lifetime.
class WithoutGil {
 public:
  WithoutGil();
  ~WithoutGil();
  WithoutGil(const WithoutGil&) = delete;
  WithoutGil& operator=(const WithoutGil&) = delete;
  WithoutGil(WithoutGil&&) = delete;
  WithoutGil& operator=(WithoutGil&&) = delete;
};

/// Holds the GIL during its lifetime, inside or outside a WithoutGil of the same thread.
class WithGil {
 public:
  WithGil();
  ~WithGil();
  WithGil(const WithGil&) = delete;
  WithGil& operator=(const WithGil&) = delete;
  WithGil(WithGil&&) = delete;
  WithGil& operator=(WithGil&&) = delete;

 private:
  bool took_;
};

}  // namespace loopbit::python
