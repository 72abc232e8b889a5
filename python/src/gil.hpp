// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <thread>

#include <pybind11/pybind11.h>

namespace loopbit::python {

// Who has the GIL. While the interpreter ends, other threads do not get it any more: before Python
// 3.14 each is ended where it asks for it, by unwinding its stack. Destructors of C++ would then
// run without the GIL, and the first noexcept function aborts the process. Here such a thread stops
// for ever instead, as of Python 3.14. So nothing but these takes the GIL, or calls what a user
// wrote in Python.

/// What `call` returns, a call of Python's C functions; or never, if Python ends this thread there.
template <typename Call>
auto unless_ended(const Call& call) {
  try {
    return call();
  } catch (...) {  // C throws nothing else
    while (true) std::this_thread::sleep_for(std::chrono::hours(1));
  }
}

/// The GIL is free while it lives.
class WithoutGil {
 public:
  WithoutGil();
  ~WithoutGil();
  WithoutGil(const WithoutGil&) = delete;
  WithoutGil& operator=(const WithoutGil&) = delete;
  WithoutGil(WithoutGil&&) = delete;
  WithoutGil& operator=(WithoutGil&&) = delete;
};

/// Within a WithoutGil of the same thread, or where there is none: the GIL is held while it lives.
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
