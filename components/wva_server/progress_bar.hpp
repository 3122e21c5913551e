#pragma once

#include <cstdint>
#include <string>

namespace phantom::wva_server {

/// A line on a terminal that shows how far a long piece of work is. Nothing is written where stderr is no
/// terminal, and nothing in the first half second: short work shows no bar. The line is gone when the bar is.
class ProgressBar {
 public:
  explicit ProgressBar(std::string what);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// 0…1.
  void show(double share);

 private:
  std::string what_;
  bool terminal_;
  bool drawn_ = false;
  std::int64_t next_ns_;
};

/// The bar's text: "what [####    ]  50 %".
std::string bar_text(const std::string& what, double share);

}  // namespace phantom::wva_server
