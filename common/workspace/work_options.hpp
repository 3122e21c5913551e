#pragma once

#include <functional>

namespace phantom::workspace {

/// How an operation that may take seconds runs, and how its caller can stop it.
struct WorkOptions {
  int threads = 1;
  /// Called now and then in the caller's thread with the share that is done. Returning false ends the
  /// operation without a result.
  std::function<bool(double share)> go_on;
};

}  // namespace phantom::workspace
