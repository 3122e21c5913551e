#pragma once

#include <map>

#include "common/core/recent_map.hpp"
#include "common/diagnostics/graph.hpp"
#include "components/dds_recorder/recording_file.hpp"

namespace phantom::dds_recorder {

/// Who wrote a sample, as discovery tells: all processes that are there (the guard bounds their number,
/// common/wire/guard.hpp), and the kMaxGone that were there last, whose samples may not be written yet. Not
/// thread-safe.
class Processes {
 public:
  static constexpr std::size_t kMaxGone = 1024;

  void put(const diagnostics::ParticipantInfo& info) {
    WriterInfo& known = present_[info.guid];
    known.component = info.name;
    known.host = info.host;
    known.process = info.process;
  }
  /// Takes note of a writer's partition; a process that writes in several is known by the last of them.
  void put(const diagnostics::EndpointInfo& writer) {
    const auto known = present_.find(diagnostics::participant_of(writer.guid));
    if (known != present_.end())
      known->second.partition = writer.qos.partitions.empty() ? "" : writer.qos.partitions.front();
  }
  void leave(const Guid& participant) {
    const auto known = present_.find(participant);
    if (known == present_.end()) return;
    gone_.find_or_add(participant).first = std::move(known->second);
    present_.erase(known);
  }
  /// Returns the process of a writer; empty if it is not known.
  WriterInfo describe(const Guid& writer) const {
    const Guid participant = diagnostics::participant_of(writer);
    if (const auto known = present_.find(participant); known != present_.end()) return known->second;
    const WriterInfo* gone = gone_.find(participant);
    return gone == nullptr ? WriterInfo{} : *gone;
  }
  std::size_t size() const { return present_.size() + gone_.size(); }

 private:
  std::map<Guid, WriterInfo> present_;
  core::RecentMap<Guid, WriterInfo> gone_{kMaxGone};
};

}  // namespace phantom::dds_recorder
