#include "components/phantom_session/dds_adapter.hpp"

#include <array>
#include <optional>

#include "common/core/clock.hpp"
#include "common/core/host/host_interfaces.hpp"
#include "common/core/recent_map.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/topic_receiver.hpp"

namespace phantom::phantom_session {
namespace {

const char* words_for(percept::HitRule rule) {
  constexpr std::array kWords{"none", "very close", "close and moving", "nearing fast"};
  return kWords.at(static_cast<std::size_t>(rule));
}

PerceptsInForce percepts_of(const messages::MasterState& m, teleop::Counterbalance counterbalance) {
  return {m.law, counterbalance, {m.drag_chosen, m.tone_enabled, m.views_enabled, m.percept_set_automatic}};
}

JointRow row_of(const messages::MasterState& m, double t_s) {
  return {.t_s = t_s,
          .reach = m.reach,
          .law = teleop::name_of(m.law),
          .master_position = m.position,
          .operator_torque = m.operator_torque_Nm,
          .percept_torque = m.percept_torque_Nm,
          .feedback_torque = m.feedback_torque_Nm};
}

StatusSample status_of(const messages::ComponentStatus& status, double t_s) {
  StatusSample out{t_s, status.component, status.state, status.message, status.loops, {}, {}};
  // Another host may serve its page on its own loopback address only.
  if (status.host == core::host_name()) out.page = status.page;
  for (const auto& figure : status.figures) out.figures[figure.name] = figure.value;
  for (const auto& topic : status.topics) {
    if (!topic.writer) out.deadline_missed[topic.topic] += topic.deadline_missed;
  }
  return out;
}

}  // namespace

struct DdsAdapter::Impl {
  dds::Participant participant;
  Collector& collector;
  JointLog& joints;
  std::mutex mutex;
  core::Nanoseconds start_ns = core::monotonic_ns();
  std::optional<teleop::Counterbalance> counterbalance;  // as the slave last reported it
  core::RecentMap<std::uint64_t, std::string> processes{
      Collector::kMaxComponents};  // by the session of their stamps

  dds::Reader<msg::WorkspaceObject> objects;
  messages::TopicSubscriber<msg::MasterState> master;
  messages::TopicSubscriber<msg::SlaveState> slave;
  messages::TopicSubscriber<msg::Percept> percept;
  messages::TopicSubscriber<msg::HitAlert> hits;
  dds::Reader<msg::ComponentStatus> status;

  // Passes a sample to `take` under the lock.
  template <class Take>
  auto into(Take take) {
    return [this, take](const auto& sample) {
      const std::lock_guard guard(mutex);
      take(sample, core::seconds(sample.received_ns - start_ns));
    };
  }

  // Reports what another process has written beside the followed one.
  template <class Message>
  void report_foreign(const messages::TopicSubscriber<Message>& subscriber, const char* topic, double t_s) {
    const dds::SourceGuard& source = subscriber.source();
    if (source.rival_samples() == 0) return;
    const std::string* process = processes.find(source.rival_session());
    collector.on_foreign_writer(t_s, topic, process != nullptr ? *process : "a process without status",
                                source.rival_samples());
  }

  Impl(const core::NetworkOptions& network, Collector& into_collector, JointLog& into_joints)
      : participant("phantom_session", network),
        collector(into_collector),
        joints(into_joints),
        objects(participant, dds::kWorkspaceObject,
                [this](const msg::WorkspaceObject& message, const dds::SampleInfo&) {
                  const auto object = messages::from_idl(message);
                  if (!object) return false;
                  const std::lock_guard guard(mutex);
                  if (!object->removed()) collector.on_object_name(object->id, object->name);
                  return true;
                }),
        master(participant, dds::kMasterState, {}, into([this](const messages::MasterState& m, double t_s) {
                 collector.on_master(t_s, m);
                 if (counterbalance) collector.on_percepts(t_s, percepts_of(m, *counterbalance));
                 joints.on_master(m.joint_count, row_of(m, t_s));
               })),
        slave(participant, dds::kSlaveState, {}, into([this](const messages::SlaveState& s, double t_s) {
                collector.on_slave(t_s, s);
                joints.on_slave(s.position);
                counterbalance = s.counterbalance;
              })),
        percept(participant, dds::kPercept, {},
                into([this](const messages::Percept& p, double t_s) { collector.on_percept(t_s, p); })),
        hits(participant, dds::kHitAlert, {}, into([this](const messages::HitAlert& h, double t_s) {
               collector.on_hit({t_s, h.alert, words_for(h.rule), h.link_name, h.interest_point, h.object,
                                 h.cleared, AlarmCount::asks(h.rule, h.contact.time_s)});
             }),
             &percept.source()),
        status(participant, dds::kComponentStatus,
               [this](const msg::ComponentStatus& message, const dds::SampleInfo& info) {
                 const auto sample = messages::from_idl(message);
                 if (!sample) return false;
                 const std::lock_guard guard(mutex);
                 processes.find_or_add(message.stamp().session(), sample->component + " on " + sample->host);
                 const double t_s = core::seconds(info.received_ns - start_ns);
                 collector.on_status(status_of(*sample, t_s));
                 report_foreign(master, "master_state", t_s);
                 report_foreign(slave, "slave_state", t_s);
                 report_foreign(percept, "percept", t_s);
                 report_foreign(hits, "hit_alert", t_s);
                 return true;
               }) {}
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, Collector& collector, JointLog& joints)
    : impl_(std::make_unique<Impl>(network, collector, joints)) {}
DdsAdapter::~DdsAdapter() = default;
std::unique_lock<std::mutex> DdsAdapter::lock() { return std::unique_lock(impl_->mutex); }

}  // namespace phantom::phantom_session
