#pragma once

#include <cstdint>
#include <string>

namespace phantom::wva_server {

/// Draws a progress bar on one line of the terminal. Writes nothing if stderr is not a terminal, and nothing
/// in the first half second, so that short work shows no bar. The destructor removes the line.
class ProgressBar {
 public:
  explicit ProgressBar(std::string what);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// `share`: share of the work that is done, 0…1.
  void show(double share);

 private:
  std::string what_;
  bool terminal_;
  bool drawn_ = false;
  std::int64_t next_ns_;
};

/// Returns the bar's text: "what [####    ]  50 %".
std::string bar_text(const std::string& what, double share);

}  // namespace phantom::wva_server
