// Reads samples of the project's own types: their instances, and the events that they report.

#include <map>

#include "common/dds/cdr.hpp"
#include "components/dds_recorder/dds_adapter.hpp"

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
  dds::CdrCodec alerts{dds::kHitAlert}, statuses{dds::kComponentStatus}, commands{dds::kOperatorCommand};
  msg::HitAlert alert;
  msg::ComponentStatus status;
  msg::OperatorCommand command;
  std::map<std::uint64_t, std::uint64_t> newest_command;  // sequence number, by session
  std::map<std::string, msg::ComponentState> states;      // by component and host

  std::optional<std::string> in_alert(std::span<const std::uint8_t> bytes) {
    if (!triggers.hit_alert || !alerts.decode(bytes, &alert) || alert.cleared()) return {};
    std::string at = alert.interest_point().to_string();
    if (at.empty()) at = alert.link_name().to_string();
    return "hit alert " + std::to_string(alert.alert()) + " (" + at + ")";
  }
  std::optional<std::string> in_status(std::span<const std::uint8_t> bytes) {
    if (!triggers.degraded || !statuses.decode(bytes, &status)) return {};
    const std::string name = status.component_name().to_string();
    if (name == "dds_recorder") return {};
    const auto bad = [](msg::ComponentState state) {
      return state == msg::COMPONENT_DEGRADED || state == msg::COMPONENT_FAULT;
    };
    const auto [known, first] = states.emplace(name + "@" + status.host().to_string(), status.state());
    const bool turned = bad(status.state()) && (first || !bad(known->second));
    known->second = status.state();
    if (!turned) return {};
    return name + (status.state() == msg::COMPONENT_FAULT ? " is in fault: " : " is degraded: ") +
           status.message().to_string();
  }
  std::optional<std::string> in_command(std::span<const std::uint8_t> bytes) {
    if (!commands.decode(bytes, &command)) return {};
    // A stop is sent repeatedly, with the same stamp, until it is confirmed: it is one event.
    std::uint64_t& newest = newest_command[command.stamp().session()];
    const std::uint64_t number = command.stamp().sequence_number();
    if (number != 0 && number <= newest) return {};
    newest = number;
    std::string by = command.issuer().to_string();
    if (!by.empty()) by.insert(0, ", by ");
    if (command.kind() == msg::COMMAND_MARK) return "command" + by;
    if (command.kind() == msg::COMMAND_EMERGENCY_STOP && triggers.emergency_stop)
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
