#pragma once

#include <cassert>
#include <optional>
#include <string>
#include <utility>

namespace phantom::core {

/// Kind of error; the message says what went wrong, where, and what is allowed.
enum class ErrorCode {
  kOk,
  kInvalidArgument,     ///< a value, file or message that is not what it must be
  kNotFound,            ///< a file, device or peer that is not there
  kResourceExhausted,   ///< a limit (size, memory, time) was reached
  kFailedPrecondition,  ///< the call is right but not in this state
  kUnavailable,         ///< may work later: a peer or a device that does not answer
  kInternal,            ///< an invariant of this project's code was violated
};

/// Result of an operation at an I/O edge. Cheap when OK. Not for the real-time path (the message allocates).
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(ErrorCode code, std::string message) : code_(code), message_(std::move(message)) {}

  static Status ok() { return {}; }
  static Status invalid_argument(std::string message) {
    return {ErrorCode::kInvalidArgument, std::move(message)};
  }
  static Status not_found(std::string message) { return {ErrorCode::kNotFound, std::move(message)}; }

  bool is_ok() const { return code_ == ErrorCode::kOk; }
  explicit operator bool() const { return is_ok(); }
  ErrorCode code() const { return code_; }
  const std::string& message() const { return message_; }

 private:
  ErrorCode code_ = ErrorCode::kOk;
  std::string message_;
};

/// A value, or the Status that says why there is none.
template <class T>
class [[nodiscard]] Expected {
 public:
  Expected(T value) : value_(std::move(value)) {}  // NOLINT: implicit by intent
  Expected(Status status) : status_(std::move(status)) {
    assert(!status_.is_ok());
  }  // NOLINT: implicit by intent

  bool has_value() const { return value_.has_value(); }
  explicit operator bool() const { return has_value(); }
  const Status& status() const { return status_; }

  T& value() & {
    assert(value_);
    return *value_;
  }
  const T& value() const& {
    assert(value_);
    return *value_;
  }
  T&& value() && {
    assert(value_);
    return std::move(*value_);
  }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T* operator->() {
    assert(value_);
    return &*value_;
  }
  const T* operator->() const {
    assert(value_);
    return &*value_;
  }

 private:
  std::optional<T> value_;
  Status status_;
};

}  // namespace phantom::core
