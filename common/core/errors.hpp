#pragma once

#include <stdexcept>

namespace phantom::core {

/// A configuration or deployment file that cannot be used. what() names file, line, key, value and what is
/// allowed. Thrown at start-up only; ends the process with exit code 2.
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A device, a file or a peer that is missing, or cannot be read. Thrown at start-up only; ends the process
/// with exit code 3.
class MissingError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace phantom::core
