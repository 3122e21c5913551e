#include "tests/support/topic_samples.hpp"

#include <map>
#include <stdexcept>

namespace phantom::test {
namespace {

// Values that differ from each other and have no bytes in common order: a swapped or shifted member shows.
double number() {
  static double last = 0.5;
  return last = -1.25 * last + 0.1234567890123;
}
std::uint32_t count() {
  static std::uint32_t last = 17;
  return (last = last * 1664525U + 1013904223U) >> 8;
}
std::uint64_t long_count() { return static_cast<std::uint64_t>(count()) << 32 | count(); }

msg::Stamp stamp() {
  msg::Stamp s;
  s.sequence_number(long_count());
  s.monotonic_ns(-static_cast<std::int64_t>(long_count()));
  s.utc_ns(static_cast<std::int64_t>(long_count()));
  s.session(long_count());
  return s;
}
msg::Echo echo() {
  msg::Echo e;
  e.sequence_number(long_count());
  e.monotonic_ns(static_cast<std::int64_t>(long_count()));
  e.session(long_count());
  return e;
}
msg::Vector3 vector() {
  msg::Vector3 v;
  v.x(number()), v.y(number()), v.z(number());
  return v;
}
msg::Pose pose() {
  msg::Pose p;
  p.position_m(vector());
  p.qx(number()), p.qy(number()), p.qz(number()), p.qw(number());
  return p;
}
template <class Array>
void fill(Array& values) {
  for (auto& value : values) value = number();
}
std::vector<std::uint8_t> octets(std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(count());
  return bytes;
}

void set(msg::MasterState& s) {
  s.stamp(stamp()), s.state(msg::LinkState::LINK_DEGRADED), s.stop(long_count()), s.joint_count(7),
      s.reach(-42), s.enabling_switch_fitted(true);
  fill(s.position_rad()), fill(s.velocity_rad_s()), fill(s.percept_torque_Nm());
  fill(s.feedback_torque_Nm()), fill(s.operator_torque_Nm());
  s.percept_gain(number()), s.feedback_gain(number()), s.percept_enabled(true), s.drag_chosen(true),
      s.tone_enabled(true), s.percept_set_automatic(true), s.feedback_damped(true), s.feedback_limited(true);
  s.slave_echo(echo()), s.drag_echo(echo()), s.round_trip_s(number());
}
void set(msg::SlaveState& s) {
  s.stamp(stamp()), s.master_echo(echo()), s.state(msg::LinkState::LINK_STOPPED),
      s.stop_cause(msg::StopCause::STOP_PARTNER), s.stop(long_count()), s.joint_count(6),
      s.motion_permitted(true);
  fill(s.position_rad()), fill(s.velocity_rad_s()), fill(s.loop_torque_Nm()),
      s.counterbalance(msg::Counterbalance::COUNTERBALANCE_AUTOMATIC), fill(s.external_torque_Nm());
  s.external_torque_measured(true), s.contact(true), s.contact_force_N(number()), s.contact_object(65500);
  s.contact_point_m(vector()), s.tool_speed_m_s(number()), s.clearance_m(-1.0);
}
void set(msg::GripperState& s) {
  s.stamp(stamp()), s.width_m(number()), s.velocity_m_s(number()), s.force_N(number()),
      s.requested_width_m(number()), s.requested_force_N(number()), s.widest_m(number()),
      s.least_force_N(number()), s.greatest_force_N(number()), s.known(true), s.holds(true), s.closed(true);
}
void set(msg::DragField& s) {
  s.stamp(stamp()), s.slave_echo(echo()), s.master_echo(echo()), s.gripper_echo(echo()),
      s.workspace_version(long_count()), s.mode(msg::DragMode::DRAG_COUPLED), s.joint_count(16);
  fill(s.coefficient_plus()), fill(s.coefficient_minus()), fill(s.coupled()), fill(s.drift()),
      fill(s.reaction()), fill(s.reaction_stiffness()), fill(s.reaction_position()), s.valid(true),
      s.model_age_s(number());
}
void set(msg::Percept& s) {
  s.stamp(stamp()), s.slave_echo(echo()), s.workspace_version(long_count()), s.valid(true);
  s.mu(number()), s.closeness(number()), s.speed_m_s(number()), s.pgs(number()), s.tick_s(number());
  s.position_m(vector()), s.velocity_m_s(vector()), s.pgv(vector());
  s.link(count()), s.sensor(count()), s.object(513), s.joint_count(7), fill(s.drag_torque_Nm());
  s.muted_sensors(count()), s.allowed_contacts(3), s.greatest_mu(number()), s.greatest_closeness(number());
  for (int i = 0; i < 3; ++i) {
    msg::Threat threat;
    threat.rule(msg::HitRule::HIT_FAR_NEARING), threat.alerts(true), threat.link(count()), threat.object(513),
        threat.mu(number()), threat.position_m(vector()), threat.time_to_contact_s(number()),
        threat.time_to_contact_error_s(-1.0), threat.gap_m(number());
    s.threats().push_back(threat);
  }
}
void set(msg::InterestPoints& s) {
  s.stamp(stamp()), s.slave_echo(echo()), s.workspace_version(long_count()), s.valid(true);
  for (const char* name : {"elbow", "", "motor of the third joint"}) {  // of odd lengths: padding differs
    msg::InterestPoint point;
    point.name(name), point.link(count()), point.mu(number()), point.position_m(vector()),
        point.pgv(vector());
    point.object(258), point.muted(true);
    s.points().push_back(point);
  }
}
void set(msg::SkinPercept& s) {
  s.stamp(stamp()), s.slave_echo(echo()), s.valid(true), s.patch_m(number()), s.patch_count(1024);
  for (int i = 0; i < 1024; ++i) {  // the bound: larger than a datagram's fragment
    msg::SkinPatch patch;
    patch.link(count()), patch.x_m(static_cast<float>(i)), patch.mu(-0.5F * static_cast<float>(i));
    s.felt().push_back(patch);
  }
}
void set(msg::HitAlert& s) {
  s.stamp(stamp()), s.alert(count()), s.link(count()), s.link_name(std::string(64, 'g')), s.sensor(count()),
      s.object(9);
  s.look_at_m(vector()), s.pgv(vector()), s.speed_m_s(number()), s.mu(number()), s.cleared(true),
      s.interest_point("elbow"), s.time_to_contact_s(number()), s.gap_m(number());
}
void set(msg::SensingCommand& s) {
  s.stamp(stamp()), s.requester("somebody"), s.object("gate_valve"), s.id(4), s.link("gripper"),
      s.duration_s(number());
}
void set(msg::SensingReply& s) {
  s.stamp(stamp()), s.command(echo()), s.requester("somebody"), s.done(true),
      s.message("17 °C · τ = 1,5 N·m");
}
void set(msg::OperatorCommand& s) {
  s.stamp(stamp()), s.kind(msg::CommandKind::COMMAND_RESET), s.value(number()), s.joint(-1),
      s.master_stop(long_count()), s.slave_stop(long_count()), s.issuer("page");
}
void set(msg::OperatorReply& s) {
  s.stamp(stamp()), s.command(echo()), s.component_name("slave_io"), s.kind(msg::CommandKind::COMMAND_RESET),
      s.done(true), s.message("Halt gelöst");
}
void set(msg::WristWrench& s) { s.stamp(stamp()), s.valid(true), s.force_N(vector()), s.torque_Nm(vector()); }
void set(msg::ViewPose& s) {
  s.stamp(stamp()), s.view(msg::ViewKind::VIEW_HIT), s.node(count()), s.automatic(true), s.X_WC(pose()),
      s.look_at_m(vector());
}
void set(msg::ViewPicture& s) {
  s.stamp(stamp()), s.view(msg::PictureView::PICTURE_TOOL), s.jpeg(octets(100'003));
}
void set(msg::CameraPicture& s) {
  s.stamp(stamp()), s.camera("gate"), s.exposed_utc_ns(long_count()), s.width(1280), s.height(719),
      s.jpeg(octets(100'003));
}
void set(msg::SensorPoints& s) {
  s.stamp(stamp()), s.measured_utc_ns(long_count()), s.frame("camera"), s.width(20'000), s.height(1);
  s.xyz_m(std::vector<float>(60'000, -0.25F));
}
void set(msg::DepthImage& s) {
  s.stamp(stamp()), s.camera("above"), s.age_s(number()), s.width(300), s.height(200);
  s.fx_px(number()), s.fy_px(number()), s.cx_px(number()), s.cy_px(number());
  s.min_depth_m(number()), s.max_depth_m(number());
  s.depth_mm(std::vector<std::uint16_t>(60'000, 1234));
}
void set(msg::HapticDevice& s) {
  s.stamp(stamp()), s.wrench_echo(echo()), s.X_DH(pose()), s.velocity_m_s(vector()),
      s.angular_velocity_rad_s(vector());
  s.ready(true), s.clutch(true), s.buttons(count()), s.grip_opening(number()), s.measured_axes(63),
      s.actuated_axes(7);
  s.max_force_N(number()), s.max_moment_N_m(number()), s.mass_kg(number()), s.inertia_kg_m2(number()),
      s.workspace_m(number()), s.workspace_rad(number()), s.period_s(number());
}
void set(msg::HapticDeviceWrench& s) {
  s.stamp(stamp()), s.device_echo(echo()), s.force_N(vector()), s.moment_N_m(vector()), s.valid(true),
      s.leads(true);
  s.time_to_live_s(number()), s.fade_s(number());
}
void set(msg::WorkspaceBrick& s) {
  s.bx(-3), s.by(70000), s.bz(2), s.version(long_count()), s.voxels_zstd(octets(100'003));
}
void set(msg::WorkspaceVersion& s) {
  s.cell("hot_cell"), s.version(long_count()), s.origin_m(vector()), s.voxel_size_m(vector()),
      s.size_x_vox(count());
  s.palette(std::vector<float>{0.0F, 9.5F, -0.0F, 32.25F}), s.brick_count(count()),
      s.content_hash(long_count());
  for (std::uint16_t id = 1; id <= 16; ++id) {
    msg::CarriedObject carried;
    carried.id(id), carried.arm("left"), carried.frame(std::string(id, 'f')), carried.X_FO(pose()),
        carried.mesh_hash(long_count()), carried.mass_kg(number());
    carried.centre_of_mass_m(vector()), carried.moments_kg_m2(vector()), carried.products_kg_m2(vector());
    s.carried().push_back(carried);
  }
}
void set(msg::WorkspaceObject& s) {
  s.id(7), s.name("pump"), s.mesh_hash(long_count()), s.X_WO(pose()), s.red(0.25F), s.green(0.5F),
      s.blue(0.75F);
}
void set(msg::MeshChunk& s) {
  s.mesh_hash(long_count()), s.chunk(5), s.chunk_count(6), s.vertex_count(count()), s.triangle_count(count());
  s.data(octets(256 * 1024));
}
void set(msg::OccupancyChange& s) {
  s.stamp(stamp()), s.source("workspace_camera"), s.cell("hot_cell"), s.origin_m(vector());
  s.voxel_size_m(number()), s.size_x_vox(count()), s.size_y_vox(count()), s.size_z_vox(count());
  s.whole(true), s.image_age_s(number());
  for (std::uint16_t i = 0; i < 1500; ++i) {
    msg::OccupancyBlock block;
    block.x(i), block.y(1023), block.z(7);
    for (auto& word : block.bits()) word = long_count();
    s.blocks().push_back(block);
  }
  msg::DepthCameraHealth camera;
  camera.name("above"), camera.state(msg::DepthCameraState::DEPTH_CAMERA_LATE), camera.age_s(number()),
      camera.rate_hz(number());
  s.cameras().assign(16, camera);
}
void set(msg::WorkspaceCommand& s) {
  s.stamp(stamp()), s.requester("somebody"), s.object("pump"), s.id(6), s.X_WO(pose()), s.sets_guard(true),
      s.guard_vox(2), s.description(std::string(16384, 'y'));
  s.arm("left"), s.frame("tool"), s.sets_pose(true), s.X_FO(pose());
}
void set(msg::WorkspaceReply& s) {
  s.stamp(stamp()), s.command(echo()), s.object("pump"), s.id(6), s.message("moved"), s.version(long_count());
  s.changed_bricks(count()), s.removed_bricks(count()), s.seconds(number());
}
void set(msg::ComponentStatus& s) {
  s.component_name("slave_io"), s.host("cell-7"), s.stamp(stamp()), s.process_id(count()),
      s.state(msg::ComponentState::COMPONENT_DEGRADED);
  s.message("holding: the master is silent"), s.page("http://127.0.0.1:8080/");
  for (int i = 0; i < 8; ++i) {
    msg::LoopStatistics loop;
    loop.name(std::string(static_cast<std::size_t>(i), 'l')), loop.rate_hz(number()),
        loop.ticks(long_count());
    s.loops().push_back(loop);
    msg::TopicStatistics topic;
    topic.topic("percept"), topic.writer(i % 2 == 0), topic.matched(count()), topic.refused(long_count());
    s.topics().push_back(topic);
    msg::Figure figure;
    figure.name("model_age"), figure.value(number()), figure.unit("ms");
    s.figures().push_back(figure);
  }
}

using Builder = std::function<void(const std::function<void(void*)>&)>;

template <class T>
std::pair<const std::string, Builder> entry(const dds::TopicSpec<T>& topic) {
  return {topic.name, [](const std::function<void(void*)>& use) {
            T sample;
            set(sample);
            use(&sample);
          }};
}

}  // namespace

void with_sample(const dds::TopicDescription& topic, const std::function<void(void*)>& use) {
  static const std::map<std::string, Builder> builders{
      entry(dds::kMasterState),        entry(dds::kSlaveState),       entry(dds::kDragField),
      entry(dds::kGripperState),       entry(dds::kPercept),          entry(dds::kInterestPoints),
      entry(dds::kSkinPercept),        entry(dds::kHitAlert),         entry(dds::kSensingCommand),
      entry(dds::kSensingReply),       entry(dds::kOperatorCommand),  entry(dds::kRecordingRequest),
      entry(dds::kOperatorReply),      entry(dds::kViewPose),         entry(dds::kWristWrench),
      entry(dds::kViewPicture),        entry(dds::kCameraPicture),    entry(dds::kSensorPoints),
      entry(dds::kWorkspaceBrick),     entry(dds::kWorkspaceVersion), entry(dds::kHapticDevice),
      entry(dds::kHapticDeviceWrench), entry(dds::kWorkspaceObject),  entry(dds::kMeshChunk),
      entry(dds::kDepthImage),         entry(dds::kOccupancyChange),  entry(dds::kWorkspaceCommand),
      entry(dds::kWorkspaceReply),     entry(dds::kComponentStatus)};
  const auto builder = builders.find(topic.name);
  if (builder == builders.end())
    throw std::runtime_error(std::string(topic.name) + ": no sample of it here; add one to samples.cpp");
  builder->second(use);
}

}  // namespace phantom::test
