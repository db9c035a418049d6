// SPDX-License-Identifier: Apache-2.0
// The one exception type: thrown at load, configuration and device boundaries, caught once per
// command, request or session.
#pragma once
#include <stdexcept>
#include <string>

namespace scolopax {

enum class ErrorCode {
  badInput,     ///< a file or a value is not what its format allows
  unsupported,  ///< valid, but this program cannot handle it
  notFound,
  tooLarge,  ///< beyond a stated limit or the available memory
  busy,      ///< limit reached for now, as others hold the resource; retry later
  io,        ///< reading or writing failed
  device,    ///< a GPU or its driver failed
  cancelled  ///< abandoned: the result is no longer needed
};

/// `what()` is one line a user can act on: file or field, what was expected, what was found.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ErrorCode code() const { return code_; }

 private:
  ErrorCode code_;
};

[[noreturn]] inline void failBadInput(const std::string& what) { throw Error(ErrorCode::badInput, what); }

}  // namespace scolopax
