// Conversion from topic messages to the viewer's samples.

#include <algorithm>
#include <cmath>

#include "components/synthetic_viewer/commands.hpp"
#include "components/synthetic_viewer/dds_adapter.hpp"
#include "components/synthetic_viewer/mesh_assembler.hpp"

namespace phantom::synthetic_viewer {
namespace {

bool finite(std::initializer_list<double> values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

bool is_stamped(const msg::Stamp& stamp) { return stamp.sequence_number() > 0; }

/// Received enumerators are unchecked; both enumerations have the same order.
template <class To, class From>
std::optional<To> enumerator(From value, To last) {
  const auto number = static_cast<std::int64_t>(value);
  if (number < 0 || number > static_cast<std::int64_t>(last)) return std::nullopt;
  return static_cast<To>(number);
}

}  // namespace

std::optional<WorkspaceSample> convert(const msg::WorkspaceVersion& message) {
  if (message.version() == 0 || !(message.voxel_size_m() > 0 && message.voxel_size_m() <= 1))
    return std::nullopt;
  return WorkspaceSample{message.version(), message.voxel_size_m()};
}

SkinSample skin_of(const messages::SkinPercept& percept, core::Nanoseconds received_ns) {
  SkinSample sample;
  sample.received_ns = received_ns;
  sample.valid = percept.valid && percept.greatest_mu_Pa_s_per_m > 0;
  sample.patch_m = percept.patch_m;
  if (!sample.valid) return sample;
  for (const messages::SkinPatch& patch : percept.felt) {
    const double share = static_cast<double>(patch.mu_Pa_s_per_m) / percept.greatest_mu_Pa_s_per_m;
    sample.felt.push_back({patch.link, patch.middle_m, static_cast<float>(std::min(1.0, share))});
  }
  return sample;
}

std::optional<MeshChunkSample> convert(const msg::MeshChunk& message) {
  MeshChunkSample sample{message.mesh_hash(),    message.chunk(),          message.chunk_count(),
                         message.vertex_count(), message.triangle_count(), message.data()};
  if (!check_chunk(sample).is_ok()) return std::nullopt;
  return sample;
}

std::optional<ComponentSample> convert(const msg::ComponentStatus& message) {
  const auto state = enumerator(message.state(), core::ComponentState::kFault);
  ComponentSample sample;
  sample.name = message.component_name().c_str();
  sample.host = message.host().c_str();
  sample.message = message.message().c_str();
  if (!is_stamped(message.stamp()) || !state || sample.name.empty()) return std::nullopt;
  sample.state = *state;
  for (const msg::LoopStatistics& loop : message.loops()) {
    if (!finite({loop.period_s(), loop.rate_hz(), loop.wakeup_p50_us(), loop.wakeup_p99_us(),
                 loop.wakeup_max_us(), loop.work_p50_us(), loop.work_max_us(), loop.idle_s()})) {
      return std::nullopt;
    }
    sample.loops.push_back({loop.name().c_str(), loop.period_s(), loop.rate_hz(), loop.wakeup_p50_us(),
                            loop.wakeup_p99_us(), loop.wakeup_max_us(), loop.work_p50_us(),
                            loop.work_max_us(), loop.ticks(), loop.slips(), loop.idle_s()});
  }
  for (const msg::Figure& figure : message.figures()) {
    sample.figures.push_back({figure.name().c_str(), figure.value(), figure.unit().c_str()});
  }
  for (const msg::TopicStatistics& topic : message.topics()) {
    sample.refused += topic.refused();
    sample.deadline_missed += topic.deadline_missed();
    sample.incompatible_qos += topic.incompatible_qos();
  }
  return sample;
}

std::optional<Command> convert(const msg::OperatorCommand& message) {
  const auto kind = enumerator(message.kind(), CommandKind::kMark);
  if (!is_stamped(message.stamp()) || !kind) return std::nullopt;
  const Command command{*kind, message.value()};
  if (!check_command(command).is_ok()) return std::nullopt;
  return command;
}

}  // namespace phantom::synthetic_viewer
