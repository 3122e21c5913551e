#include "components/phantom_session/dds_adapter.hpp"

#include <cmath>

#include "common/core/clock.hpp"
#include "common/dds/endpoint.hpp"
#include "common/dds/status_reporter.hpp"

namespace phantom::phantom_session {
namespace {

double greatest(const std::array<double, 16>& values, std::uint32_t count) {
  double greatest = 0.0;
  for (std::uint32_t i = 0; i < std::min<std::uint32_t>(count, 16); ++i)
    greatest = std::max(greatest, std::abs(values[i]));
  return greatest;
}

const char* rule_name(msg::HitRule rule) {
  switch (rule) {
    case msg::HIT_VERY_CLOSE:
      return "very close";
    case msg::HIT_MODERATE_MOVING:
      return "close and moving";
    case msg::HIT_FAR_NEARING:
      return "nearing fast";
    default:
      return "none";
  }
}

const char* law_name(msg::BilateralLaw law) {
  constexpr const char* kNames[] = {"pf", "sctfb", "pfff", "pe", "peff"};
  return law <= msg::LAW_PEFF ? kNames[law] : "unknown";
}

JointRow row_of(const msg::MasterState& m, double t_s) {
  return {.t_s = t_s,
          .reach = m.reach(),
          .law = law_name(m.law()),
          .master_position = m.position_rad(),
          .operator_torque = m.operator_torque_Nm(),
          .percept_torque = m.percept_torque_Nm(),
          .feedback_torque = m.feedback_torque_Nm()};
}

const char* motion_name(msg::MotionClass motion) {
  switch (motion) {
    case msg::MOTION_SAFE:
      return "leaving";
    case msg::MOTION_NEUTRAL:
      return "passing";
    case msg::MOTION_DANGEROUS:
      return "nearing";
    default:
      return "";
  }
}

PerceptSample percept_of(const msg::Percept& percept, double t_s) {
  PerceptSample out{t_s,
                    percept.valid(),
                    percept.mu(),
                    percept.closeness(),
                    percept.link(),
                    percept.object(),
                    motion_name(percept.motion()),
                    {},
                    percept.muted_sensors()};
  const auto count = std::min<std::size_t>(percept.joint_count(), percept.drag_torque_Nm().size());
  out.torque.assign(percept.drag_torque_Nm().begin(),
                    percept.drag_torque_Nm().begin() + static_cast<std::ptrdiff_t>(count));
  return out;
}

core::ComponentState state_of(msg::ComponentState state) {
  switch (state) {
    case msg::COMPONENT_STARTING:
      return core::ComponentState::kStarting;
    case msg::COMPONENT_READY:
      return core::ComponentState::kReady;
    case msg::COMPONENT_RUNNING:
      return core::ComponentState::kRunning;
    case msg::COMPONENT_DEGRADED:
      return core::ComponentState::kDegraded;
    case msg::COMPONENT_STOPPED:
      return core::ComponentState::kStopped;
    default:
      return core::ComponentState::kFault;
  }
}

StatusSample status_of(const msg::ComponentStatus& status, double t_s) {
  StatusSample out{
      t_s, status.component_name().to_string(), state_of(status.state()), status.message().to_string(), {},
      {}};
  // Another host's page may be served on its own loopback address alone.
  if (status.host() == dds::host_name()) out.page = status.page().to_string();
  for (const auto& loop : status.loops()) {
    out.loops.push_back({loop.name().to_string(), loop.period_s(), loop.rate_hz(), loop.wakeup_p50_us(),
                         loop.wakeup_p99_us(), loop.wakeup_max_us(), loop.work_p50_us(), loop.work_max_us(),
                         loop.ticks(), loop.slips()});
  }
  for (const auto& figure : status.figures()) out.figures[figure.name().to_string()] = figure.value();
  for (const auto& topic : status.topics()) {
    if (!topic.writer()) out.deadline_missed[topic.topic().to_string()] += topic.deadline_missed();
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

  dds::Reader<msg::WorkspaceObject> objects;
  dds::Reader<msg::MasterState> master;
  dds::Reader<msg::SlaveState> slave;
  dds::Reader<msg::Percept> percept;
  dds::Reader<msg::HitAlert> hits;
  dds::Reader<msg::ComponentStatus> status;

  // Hands a converted sample to the collector under the lock.
  template <class Convert>
  auto into(Convert convert) {
    return [this, convert](const auto& sample, const dds::SampleInfo& info) {
      const std::lock_guard guard(mutex);
      convert(sample, core::seconds(info.received_ns - start_ns));
    };
  }

  Impl(const core::NetworkOptions& network, Collector& into_collector, JointLog& into_joints)
      : participant("phantom_session", network),
        collector(into_collector),
        joints(into_joints),
        objects(participant, dds::kWorkspaceObject, into([this](const msg::WorkspaceObject& o, double) {
                  if (o.mesh_hash() != 0) collector.on_object_name(o.id(), o.name().to_string());
                })),
        master(participant, dds::kMasterState, into([this](const msg::MasterState& m, double t_s) {
                 collector.on_master({t_s, m.reach(), m.percept_enabled(),
                                      greatest(m.percept_torque_Nm(), m.joint_count()),
                                      greatest(m.feedback_torque_Nm(), m.joint_count()),
                                      greatest(m.operator_torque_Nm(), m.joint_count()), m.round_trip_s()});
                 joints.on_master(m.joint_count(), row_of(m, t_s));
               })),
        slave(participant, dds::kSlaveState, into([this](const msg::SlaveState& s, double t_s) {
                collector.on_slave({t_s, s.contact(), s.contact_force_N(), s.contact_object(),
                                    s.tool_speed_m_s(), s.clearance_m()});
                joints.on_slave(s.position_rad());
              })),
        percept(participant, dds::kPercept, into([this](const msg::Percept& p, double t_s) {
                  collector.on_percept(percept_of(p, t_s));
                })),
        hits(participant, dds::kHitAlert, into([this](const msg::HitAlert& h, double t_s) {
               collector.on_hit({t_s, h.alert(), rule_name(h.rule()), h.link_name().to_string(),
                                 h.interest_point().to_string(), h.object(), h.cleared()});
             })),
        status(participant, dds::kComponentStatus, into([this](const msg::ComponentStatus& s, double t_s) {
                 collector.on_status(status_of(s, t_s));
               })) {}
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, Collector& collector, JointLog& joints)
    : impl_(std::make_unique<Impl>(network, collector, joints)) {}
DdsAdapter::~DdsAdapter() = default;
std::unique_lock<std::mutex> DdsAdapter::lock() { return std::unique_lock(impl_->mutex); }

}  // namespace phantom::phantom_session
