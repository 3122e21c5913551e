#include "components/phantom_session/dds_adapter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "common/core/clock.hpp"
#include "common/core/host/host_interfaces.hpp"
#include "common/core/recent_map.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/messages/checked_reader.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"

namespace phantom::phantom_session {
namespace {

double greatest(const core::JointArray& values) {
  double most = 0.0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

const char* words_for(percept::HitRule rule) {
  constexpr std::array kWords{"none", "very close", "close and moving", "nearing fast"};
  return kWords.at(static_cast<std::size_t>(rule));
}

const char* words_for(percept::MotionClass motion) {
  constexpr std::array kWords{"", "leaving", "passing", "nearing"};
  return kWords.at(static_cast<std::size_t>(motion));
}

MasterSample sample_of(const messages::MasterState& m, double t_s) {
  return {t_s,
          m.reach,
          m.percept_enabled,
          greatest(m.percept_torque_Nm),
          greatest(m.feedback_torque_Nm),
          greatest(m.operator_torque_Nm),
          m.round_trip_s};
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

PerceptSample sample_of(const messages::Percept& percept, double t_s) {
  const auto torques = percept.drag_torque_Nm.begin();
  return {t_s,
          percept.valid,
          percept.mu_Pa_s_per_m,
          percept.closeness,
          percept.link,
          percept.object,
          words_for(percept.motion),
          {torques, torques + static_cast<std::ptrdiff_t>(percept.joint_count)},
          percept.muted_sensors};
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
  messages::CheckedReader<msg::MasterState> master;
  messages::CheckedReader<msg::SlaveState> slave;
  dds::Reader<msg::Percept> percept;
  dds::Reader<msg::HitAlert> hits;
  dds::Reader<msg::ComponentStatus> status;

  // Passes a converted sample to `take` under the lock. Invalid samples are skipped.
  template <class Take>
  auto into(Take take) {
    return [this, take](const auto& message, const dds::SampleInfo& info) {
      const auto sample = messages::from_idl(message);
      if (!sample) return;
      const std::lock_guard guard(mutex);
      take(*sample, core::seconds(info.received_ns - start_ns));
    };
  }

  // Likewise, of the one process that a CheckedReader follows.
  template <class Take>
  auto followed(Take take) {
    return [this, take](const auto& sample, core::Nanoseconds received_ns) {
      const std::lock_guard guard(mutex);
      take(sample, core::seconds(received_ns - start_ns));
    };
  }

  // Reports what another process has written beside the followed one.
  template <class Message>
  void report_foreign(const messages::CheckedReader<Message>& reader, const char* topic, double t_s) {
    if (reader.rival_samples() == 0) return;
    const std::string* process = processes.find(reader.rival_session());
    collector.on_foreign_writer(t_s, topic, process != nullptr ? *process : "a process without status",
                                reader.rival_samples());
  }

  Impl(const core::NetworkOptions& network, Collector& into_collector, JointLog& into_joints)
      : participant("phantom_session", network),
        collector(into_collector),
        joints(into_joints),
        objects(participant, dds::kWorkspaceObject,
                into([this](const messages::WorkspaceObject& object, double) {
                  if (!object.removed()) collector.on_object_name(object.id, object.name);
                })),
        master(participant, dds::kMasterState, {},
               followed([this](const messages::MasterState& m, double t_s) {
                 collector.on_master(sample_of(m, t_s));
                 if (counterbalance) collector.on_percepts(t_s, percepts_of(m, *counterbalance));
                 joints.on_master(m.joint_count, row_of(m, t_s));
               })),
        slave(participant, dds::kSlaveState, {}, followed([this](const messages::SlaveState& s, double t_s) {
                collector.on_slave(
                    {t_s, s.contact, s.contact_force_N, s.contact_object, s.tool_speed_m_s, s.clearance_m});
                joints.on_slave(s.position);
                counterbalance = s.counterbalance;
              })),
        percept(participant, dds::kPercept, into([this](const messages::Percept& p, double t_s) {
                  collector.on_percept(sample_of(p, t_s));
                })),
        hits(participant, dds::kHitAlert, into([this](const messages::HitAlert& h, double t_s) {
               collector.on_hit(
                   {t_s, h.alert, words_for(h.rule), h.link_name, h.interest_point, h.object, h.cleared});
             })),
        status(participant, dds::kComponentStatus,
               [this](const msg::ComponentStatus& message, const dds::SampleInfo& info) {
                 const auto sample = messages::from_idl(message);
                 if (!sample) return;
                 const std::lock_guard guard(mutex);
                 processes.find_or_add(message.stamp().session(), sample->component + " on " + sample->host);
                 const double t_s = core::seconds(info.received_ns - start_ns);
                 collector.on_status(status_of(*sample, t_s));
                 report_foreign(master, "master_state", t_s);
                 report_foreign(slave, "slave_state", t_s);
               }) {}
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, Collector& collector, JointLog& joints)
    : impl_(std::make_unique<Impl>(network, collector, joints)) {}
DdsAdapter::~DdsAdapter() = default;
std::unique_lock<std::mutex> DdsAdapter::lock() { return std::unique_lock(impl_->mutex); }

}  // namespace phantom::phantom_session
