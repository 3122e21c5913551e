// Reads samples of the project's own types: their instances, and the events that they report.

#include <map>

#include "common/core/recent_map.hpp"
#include "common/dds/endpoints/cdr.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "components/dds_recorder/adapter/dds_adapter.hpp"

namespace phantom::dds_recorder {

struct InstanceFinder::Impl {
  std::map<std::string, std::optional<dds::CdrCodec>> codecs;  // by type; none: not the project's type
};

InstanceFinder::InstanceFinder() : impl_(std::make_unique<Impl>()) {}
InstanceFinder::~InstanceFinder() = default;

bool InstanceFinder::find(const std::string& type, std::span<const std::uint8_t> bytes,
                          InstanceKey& instance) {
  auto known = impl_->codecs.find(type);
  if (known == impl_->codecs.end()) {
    known = impl_->codecs.emplace(type, std::nullopt).first;
    if (const auto* topic = dds::topic_of_type(type)) known->second.emplace(*topic);
  }
  return known->second && known->second->instance_of(bytes, instance);
}

struct EventWatch::Impl {
  Triggers triggers;
  static constexpr std::size_t kMax = 256;                             // senders that are remembered
  core::RecentMap<std::uint64_t, std::uint64_t> newest_command{kMax};  // sequence number, by session
  core::RecentMap<std::string, core::ComponentState> states{kMax};     // by component and host

  template <class Message>
  static auto decoded(const dds::TopicSpec<Message>& topic, std::span<const std::uint8_t> bytes)
      -> decltype(messages::from_idl(std::declval<const Message&>())) {
    static const dds::CdrCodec codec(topic);
    Message message;
    if (!codec.decode(bytes, &message)) return core::Status::invalid_argument("the octets are not its type");
    return messages::from_idl(message);
  }

  std::optional<std::string> in_alert(std::span<const std::uint8_t> bytes) const {
    const auto alert = decoded(dds::kHitAlert, bytes);
    if (!triggers.hit_alert || !alert || alert->cleared) return {};
    return "hit alert " + std::to_string(alert->alert) + " (" +
           (alert->interest_point.empty() ? alert->link_name : alert->interest_point) + ")";
  }
  std::optional<std::string> in_status(std::span<const std::uint8_t> bytes) {
    using core::ComponentState;
    const auto status = decoded(dds::kComponentStatus, bytes);
    if (!triggers.degraded || !status || status->component == "dds_recorder") return {};
    const auto bad = [](ComponentState state) {
      return state == ComponentState::kDegraded || state == ComponentState::kFault;
    };
    const auto [known, first] = states.find_or_add(status->component + "@" + status->host, status->state);
    const bool turned = bad(status->state) && (first || !bad(known));
    known = status->state;
    if (!turned) return {};
    return status->component +
           (status->state == ComponentState::kFault ? " is in fault: " : " is degraded: ") + status->message;
  }
  std::optional<std::string> in_command(std::span<const std::uint8_t> bytes) {
    const auto command = decoded(dds::kOperatorCommand, bytes);
    if (!command) return {};
    // A stop is sent repeatedly, with the same stamp, until it is confirmed: it is one event.
    std::uint64_t& newest = newest_command.find_or_add(command->stamp.session, 0).first;
    if (command->stamp.sequence_number <= newest) return {};
    newest = command->stamp.sequence_number;
    const std::string by = command->issuer.empty() ? "" : ", by " + command->issuer;
    if (command->kind == teleop::CommandKind::kMark) return "command" + by;
    if (command->kind == teleop::CommandKind::kEmergencyStop && triggers.emergency_stop)
      return "emergency stop" + by;
    return {};
  }
};

EventWatch::EventWatch(const Triggers& triggers) : impl_(std::make_unique<Impl>()) {
  impl_->triggers = triggers;
}
EventWatch::~EventWatch() = default;

std::optional<std::string> EventWatch::event_in(const TopicInfo& topic, std::span<const std::uint8_t> bytes) {
  if (topic.type == dds::kHitAlert.type_name) return impl_->in_alert(bytes);
  if (topic.type == dds::kComponentStatus.type_name) return impl_->in_status(bytes);
  if (topic.type == dds::kOperatorCommand.type_name) return impl_->in_command(bytes);
  return {};
}

}  // namespace phantom::dds_recorder
