#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/core/recent_map.hpp"
#include "common/diagnostics/graph.hpp"
#include "components/dds_spy/system_view.hpp"

namespace phantom::dds_spy {

/// Selects the samples to show and formats each as text or as a line of JSON. Not thread-safe.
class Echo {
 public:
  /// `every_s`: shows at most one sample per writer and instance in this time. `most`: greatest number of
  /// samples in all, 0: no limit.
  Echo(bool json, double every_s, std::uint64_t most);
  /// Returns the sample's text with its line feed; none if the sample is not to be shown.
  std::optional<std::string> take(const ReceivedSample& sample, const diagnostics::Graph& graph);
  std::uint64_t shown() const { return shown_; }
  bool complete() const { return most_ != 0 && shown_ >= most_; }

 private:
  bool json_;
  core::Nanoseconds every_ns_;
  std::uint64_t most_, shown_ = 0;
  static constexpr std::size_t kMax = 65536;  // instances that are remembered
  core::RecentMap<std::pair<diagnostics::Guid, std::string>, core::Nanoseconds> last_ns_{kMax};
};

}  // namespace phantom::dds_spy
