#pragma once

#include <string>

#include "common/core/recent_map.hpp"
#include "common/dds/admission/source_guard.hpp"

namespace phantom::synthetic_viewer {

/// Whose component_status is heeded: of each name (component and host) one process, and of at most `most`
/// names. Names that nobody knows do not displace those that are heard. Used by one thread.
class ComponentNames {
 public:
  static constexpr core::Nanoseconds kHold_ns = 3 * core::kNsPerSecond / 2;  // the topic comes at 2 Hz
  /// A name that has been silent for so long makes room for a new one when there are too many.
  static constexpr core::Nanoseconds kForgotten_ns = 10 * core::kNsPerSecond;

  explicit ComponentNames(std::size_t most) : sources_(most) {}

  /// Returns whether a sample is heeded.
  bool accept(const std::string& name, const msg::Stamp& stamp, core::Nanoseconds received_ns) {
    if (sources_.full() && !sources_.contains(name) &&
        received_ns - sources_.oldest().heard_ns < kForgotten_ns)
      return false;
    Source& known = sources_.find_or_add(name).first;
    known.heard_ns = received_ns;
    return known.source.assess(stamp, received_ns) == dds::SourceGuard::Verdict::kAccepted;
  }
  /// Returns whether a second process sends under a name.
  bool has_second(const std::string& name, core::Nanoseconds now_ns) const {
    const Source* known = sources_.find(name);
    return known != nullptr && known->source.has_second(now_ns);
  }

 private:
  struct Source {
    dds::SourceGuard source{kHold_ns};
    core::Nanoseconds heard_ns = 0;
  };
  core::RecentMap<std::string, Source> sources_;
};

}  // namespace phantom::synthetic_viewer
