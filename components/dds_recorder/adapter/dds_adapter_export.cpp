#include "components/dds_recorder/adapter/dds_adapter_export.hpp"

#include <algorithm>
#include <optional>
#include <ostream>

#include "common/core/errors.hpp"
#include "common/dds/endpoints/cdr.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/runtime/process/process.hpp"
#include "components/dds_recorder/adapter/dds_adapter_bag.hpp"

namespace phantom::dds_recorder {
namespace {

constexpr std::uint64_t kDiagnosticsPeriod_ns = 1'000'000'000;

// What is recorded of a ROS 2 domain keeps its QoS.
dds::QosContract qos_of(const recording::Channel& channel) {
  dds::QosContract qos = is_durable(channel) ? ros2::kLatched : ros2::kDefault;
  if (metadata_of(channel, "qos.reliability") == "best effort")
    qos.reliability = dds::Reliability::kBestEffort;
  return qos;
}

template <class Message>
using SampleOf = std::remove_cvref_t<decltype(*messages::from_idl(std::declval<const Message&>()))>;

/// Says in the bag what a recording has, sample by sample in their order.
class Export : public RecordingListener {
 public:
  Export(const ExportRequest& request, const robot::SerialArm& arm, Ros2Bag& bag)
      : bounds_(messages::bounds_of(arm)),
        words_(arm, request.names),
        topics_(request.names.prefix),
        interval_ns_(request.rate_Hz > 0.0 ? static_cast<std::uint64_t>(1e9 / request.rate_Hz) : 0),
        bag_(bag) {}

  /// Writes what holds all the time.
  void say_fixed(std::uint64_t at_ns, const std::string& urdf) {
    begin_ns_ = at_ns;
    bag_.put(topics_.fixed_transforms, words_.fixed_transforms(static_cast<core::Nanoseconds>(at_ns)), at_ns,
             at_ns);
    if (!urdf.empty()) bag_.put(topics_.description, ros2::text_message(urdf), at_ns, at_ns);
    diagnostics_due_ns_ = at_ns + kDiagnosticsPeriod_ns;
  }

  void take(const recording::Channel& channel, const recording::Message& message, bool says) override {
    at_ = {message.log_time_ns, message.publish_time_ns == 0 ? message.log_time_ns : message.publish_time_ns};
    const auto utc_ns = static_cast<core::Nanoseconds>(at_.second);
    if (says) say_diagnostics();
    const auto of = [&](const auto& topic) { return channel.topic == topic.name; };
    if (of(dds::kComponentStatus)) {
      if (const auto status = read(dds::kComponentStatus, message))
        diagnostics_.hear(*status, static_cast<core::Nanoseconds>(at_.first));
    } else if (of(dds::kHitAlert)) {
      if (const auto alert = read(dds::kHitAlert, message)) diagnostics_.hear(*alert);
    } else if (of(dds::kSlaveState)) {
      const auto state = due(channel) ? read(dds::kSlaveState, message) : std::nullopt;
      if (!state) return;
      slave_position_ = state->position;
      put(topics_.slave, words_.joints(*state, utc_ns));
      put(topics_.transforms, words_.transforms(*state, utc_ns));
    } else if (of(dds::kMasterState)) {
      const auto state = due(channel) ? read(dds::kMasterState, message) : std::nullopt;
      if (!state) return;
      put(topics_.master, words_.joints(*state, utc_ns));
      put(topics_.torque_wrench, words_.wrench(state->position, state->percept_torque_Nm, utc_ns));
    } else if (of(dds::kPercept)) {
      const auto felt = due(channel) ? read(dds::kPercept, message) : std::nullopt;
      if (felt) say(*felt, utc_ns);
    } else {
      say_as_it_is(channel, message);
    }
  }

  void end(std::ostream& notes) const {
    for (const auto& [topic, why] : refused_)
      notes << topic << ": " << why.first << " samples left out: " << why.second << '\n';
  }

 private:
  bool due(const recording::Channel& channel) {
    std::uint64_t& due_ns = due_ns_[channel.topic];
    if (at_.first < due_ns) return false;
    due_ns = at_.first + interval_ns_;
    return true;
  }

  template <class PubSubType>
  void put(const ros2::TopicName<PubSubType>& topic, const typename PubSubType::type& message) {
    bag_.put(topic, message, at_.first, at_.second);
  }

  void say(const messages::Percept& felt, core::Nanoseconds utc_ns) {
    put(topics_.closeness, words_.closeness(felt));
    put(topics_.speed, words_.speed(felt));
    if (felt.valid) put(topics_.drag, words_.drag(felt, utc_ns));
    if (felt.valid && slave_position_)
      put(topics_.drag_wrench, words_.wrench(*slave_position_, felt.drag_torque_Nm, utc_ns));
    put(topics_.worst_place, words_.worst_place(felt, utc_ns));
  }

  void say_diagnostics() {
    for (; diagnostics_due_ns_ <= at_.first; diagnostics_due_ns_ += kDiagnosticsPeriod_ns) {
      const auto due_ns = static_cast<core::Nanoseconds>(diagnostics_due_ns_);
      bag_.put(topics_.diagnostics, diagnostics_.message(due_ns, due_ns), diagnostics_due_ns_,
               diagnostics_due_ns_);
    }
  }

  void say_as_it_is(const recording::Channel& channel, const recording::Message& message) {
    const ros2::MessageType* type = ros2::find_message_type(metadata_of(channel, "type"));
    if (type == nullptr || !channel.topic.starts_with("rt/")) return;
    // What was latched before the range holds at its begin.
    if (!bag_.put(channel.topic.substr(3), *type, qos_of(channel), message.data,
                  std::max(at_.first, begin_ns_), at_.second))
      refuse(channel.topic, "the topic has two types");
  }

  template <class Message>
  auto read(const dds::TopicSpec<Message>& topic, const recording::Message& message)
      -> std::optional<SampleOf<Message>> {
    static const dds::CdrCodec codec(topic);
    Message sample;
    if (!codec.decode(message.data, &sample)) return refuse(topic.name, "the bytes are not a sample");
    auto made = messages::from_idl(sample, bounds_);
    if (!made) return refuse(topic.name, made.status().message());
    return std::move(made).value();
  }

  std::nullopt_t refuse(const std::string& topic, const std::string& why) {
    auto& [count, reason] = refused_[topic];
    if (++count == 1) reason = why;
    return std::nullopt;
  }

  const messages::ArmBounds bounds_;
  const ros2::FromPhantom words_;
  const ros2::FromPhantomTopics topics_;
  const std::uint64_t interval_ns_;
  Ros2Bag& bag_;
  ros2::Diagnostics diagnostics_;
  std::optional<core::JointArray> slave_position_;  // as said last
  std::pair<std::uint64_t, std::uint64_t> at_;      // when the sample in hand was recorded, and sent
  std::uint64_t begin_ns_ = 0, diagnostics_due_ns_ = 0;
  std::map<std::string, std::uint64_t> due_ns_;
  std::map<std::string, std::pair<std::uint64_t, std::string>> refused_;
};

}  // namespace

int run_export(const ExportRequest& request, const robot::SerialArm& arm, const std::string& urdf,
               std::ostream& notes) {
  if (request.out.extension() != ".mcap")
    throw core::ConfigError("--out " + request.out.string() + ": allowed: a name that ends with .mcap");
  const auto opened = open_recordings(recordings_in(request.files));
  const recording::MessageFilter filter = in_range(request.range, times_of(opened).first);
  ReadFigures read;
  write_whole(request.out, [&](const std::filesystem::path& partial) {
    Ros2Bag bag(partial, request.zstd_level);
    Export into(request, arm, bag);
    into.say_fixed(std::max(filter.from_ns, times_of(opened).first), urdf);
    read = read_all(opened, filter, {}, into, notes);
    check_any_read(read);
    bag.finish(request.out.filename().string());
    into.end(notes);
    notes << request.out.string() << ": " << bag.messages() << " messages\n";
  });
  return exit_code_of(read, request.out.string(), notes);
}

}  // namespace phantom::dds_recorder
