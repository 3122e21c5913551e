#pragma once

#include <functional>

namespace phantom::workspace {

/// How a piece of work that may take seconds runs, and whom it asks.
struct WorkOptions {
  int threads = 1;
  std::function<bool(double share)> go_on;  ///< asked now and then by the caller's thread, with the share
                                            ///< that is done; "no" ends the work without a result
};

}  // namespace phantom::workspace
