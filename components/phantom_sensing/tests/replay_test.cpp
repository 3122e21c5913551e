// A session is recorded, and the recording gives the same samples again, to the bit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <functional>

#include "common/core/errors.hpp"
#include "common/dds/endpoints/cdr.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/recording/byte_sink.hpp"
#include "common/recording/mcap_writer.hpp"
#include "common/workspace/compression.hpp"
#include "components/phantom_sensing/dds_adapter_messages.hpp"
#include "components/phantom_sensing/tests/rig.hpp"
#include "components/phantom_sensing/tools/dds_adapter_replay.hpp"

namespace phantom::phantom_sensing {
namespace {

/// Puts samples into a file, as a recorder does.
class Tape {
 public:
  explicit Tape(const std::filesystem::path& path)
      : sink_(recording::FileSink::create(path)), writer_(**sink_, {}) {}
  template <class T>
  void put(const dds::TopicSpec<T>& topic, const T& sample) {
    std::vector<std::uint8_t> bytes;
    EXPECT_TRUE(dds::CdrCodec(topic).encode(&sample, bytes));
    while (bytes.size() % 4 != 0) bytes.push_back(0xAA);  // as RTPS pads them
    if (!channels_.contains(topic.name))
      channels_[topic.name] = *writer_.add_channel({0, 0, topic.name, "cdr", {}});
    EXPECT_TRUE(writer_.write(recording::Message{channels_[topic.name], ++sequence_, now_ns, now_ns, bytes}));
  }
  void finish() { EXPECT_TRUE(writer_.finish()); }
  std::uint64_t now_ns = 1'000'000'000'000;

 private:
  core::Expected<std::unique_ptr<recording::FileSink>> sink_;
  recording::McapWriter writer_;
  std::map<std::string, std::uint16_t> channels_;
  std::uint32_t sequence_ = 0;
};

/// What the component publishes, written down.
struct TapeSink : PerceptSink {
  TapeSink(Tape& to, const PhantomModel& of) : tape(to), model(of) {}
  template <class T>
  void put(const dds::TopicSpec<T>& topic, T& sample) {
    sample.stamp().sequence_number(++number);
    sample.stamp().monotonic_ns(clock_ns += 1000);
    sample.stamp().session(77);
    if (!lose || !lose(topic.name)) tape.put(topic, sample);
  }
  void on_drag(const StepOutputs& outputs, const TickInfo& info) override {
    msg::DragField field = messages::to_idl(drag_field_of(outputs, info, model.arm.joint_count()));
    put(dds::kDragField, field);
    felt = felt || outputs.drag.plus[0] > 0.0;
  }
  void on_percept(const StepOutputs& outputs, const TickInfo& info) override {
    msg::Percept percept = messages::to_idl(percept_of(outputs, info, model.arm.joint_count()));
    put(dds::kPercept, percept);
    msg::InterestPoints points = messages::to_idl(interest_points_of(outputs, info, model));
    put(dds::kInterestPoints, points);
  }
  void on_alert(const percept::Alert&, bool) override { ++alerts; }
  Tape& tape;
  const PhantomModel& model;
  std::uint64_t number = 0;
  core::Nanoseconds clock_ns = 0;
  int alerts = 0;
  bool felt = false;
  std::function<bool(const std::string&)> lose;
};

class RecordedSession : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::remove(path); }
  void TearDown() override { std::filesystem::remove(path); }

  void put_workspace(Tape& tape, WorkspaceSubscriber& keeper) {
    const workspace::Workspace& world = rig::wall();
    for (const auto& key : world.bricks()) {
      const std::vector<std::uint8_t> voxels = workspace::encode_brick(world.brick(key));
      msg::WorkspaceBrick brick = messages::to_idl(messages::WorkspaceBrick{key, world.version, voxels});
      tape.put(dds::kWorkspaceBrick, brick);
      keeper.put_brick({}, key, world.version, voxels);
    }
    const auto description = workspace::description_of(world, world.content_hash());
    msg::WorkspaceVersion version = messages::to_idl(messages::WorkspaceVersion{"wall", description});
    tape.put(dds::kWorkspaceVersion, version);
    keeper.commit({}, description);
    while (keeper.version() == 0) usleep(1000);
  }
  /// The same workspace again, with or without a pump in the hand.
  void put_pump(Tape& tape, WorkspaceSubscriber& keeper, std::uint64_t number, bool carried) {
    const geometry::TriangleMesh mesh = geometry::make_sphere(0.08, 2);
    const messages::MeshChunk chunk{.mesh_hash = mesh.content_hash(),
                                    .chunk = 0,
                                    .chunk_count = 1,
                                    .vertex_count = static_cast<std::uint32_t>(mesh.vertices_m.size()),
                                    .triangle_count = static_cast<std::uint32_t>(mesh.triangles.size()),
                                    .data = workspace::compress(geometry::mesh_bytes(mesh))};
    msg::MeshChunk mesh_message = messages::to_idl(chunk);
    tape.put(dds::kMeshChunk, mesh_message);
    keeper.put_mesh({}, chunk);
    messages::WorkspaceVersion version{
        "wall", workspace::description_of(rig::wall(), rig::wall().content_hash()), {}};
    version.description.version = number;
    if (carried) {
      version.carried = {{.id = 3, .arm = "left", .frame = "l7", .mesh_hash = mesh.content_hash()}};
      version.carried[0].X_FO.translation_m = {0.1, 0.0, -0.1};
    }
    msg::WorkspaceVersion message = messages::to_idl(version);
    tape.put(dds::kWorkspaceVersion, message);
    keeper.commit({}, version.description, version.carried);
    while (keeper.version() != number) usleep(1000);
  }

  /// Half a second at 1 kHz towards the wall and back, with gaps; the workspace comes after 50 ms.
  void record(const std::function<bool(const std::string&)>& lose = {}) {
    Tape tape(path);
    TapeSink sink(tape, model);
    sink.lose = lose;
    CarriedParts parts(model, config.percept);
    WorkspaceSubscriber keeper({[](const std::string& why) { ADD_FAILURE() << why; }}, SIZE_MAX, &parts);
    SensingLoop loop(model, config, keeper, sink);
    core::Nanoseconds now_ns = 5'000'000'000;
    for (std::uint64_t i = 1; i <= 500; ++i) {
      now_ns += i == 300 ? 200'000'000 : 1'000'000;  // once the state is stale for a while
      tape.now_ns += 1'000'000;
      sink.clock_ns = now_ns;
      if (i == 50) put_workspace(tape, keeper);
      if (carries && (i == 120 || i == 400)) put_pump(tape, keeper, i, i == 120);
      if (i == 300) loop.turn(now_ns);
      msg::SlaveState state;
      state.stamp().sequence_number(i);
      state.stamp().monotonic_ns(now_ns - 300'000);
      state.stamp().session(4);
      state.joint_count(static_cast<std::uint32_t>(model.arm.joint_count()));
      const double t = 0.001 * static_cast<double>(i);
      state.position_rad()[0] = 0.1 + 0.12 * std::sin(6.0 * t);
      state.velocity_rad_s()[0] = 0.72 * std::cos(6.0 * t);
      if (!lose || !lose("slave_state")) tape.put(dds::kSlaveState, state);
      if (model.has_fingers() && i % 10 == 0 && (i < 250 || i > 400)) {
        messages::GripperState gripper;
        gripper.stamp = {i, now_ns, 4};
        gripper.sense = {.known = i > 20, .width_m = 0.05 + 0.05 * std::sin(9.0 * t), .velocity_m_s = 0.45};
        gripper.widest_m = gripper.requested_width_m = 0.1;
        gripper.least_force_N = gripper.greatest_force_N = gripper.requested_force_N = 10.0;
        tape.put(dds::kGripperState, messages::to_idl(gripper));
        loop.offer(GripperSample(gripper, now_ns));
      }
      if (i % 7 == 0) continue;  // the loop was late: the newest counts
      loop.offer({*messages::from_idl(state), now_ns});
      loop.turn(now_ns + 100'000);
    }
    tape.finish();
    EXPECT_TRUE(sink.felt) << "the arm was in the fluid";
    EXPECT_GT(sink.alerts, 0);
  }
  ReplayReport replayed(const PerceptSettings& settings) {
    return replay_recording({path}, model, settings, ContactRegister(model.arm));
  }

  PhantomModel model = rig::suspended_model();
  Config config;
  bool carries = false;  // the arm takes a pump, and puts it down
  std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("phantom_replay_" + std::to_string(getpid()) + ".mcap");
};

TEST_F(RecordedSession, GivesEveryDragFieldAndPerceptAgainBitForBit) {
  record();
  const ReplayReport report = replayed(config.percept);
  for (const auto& difference : report.differences) ADD_FAILURE() << difference;
  EXPECT_TRUE(report.ok());
  EXPECT_GT(report.drag_field.equal, 350u);
  EXPECT_GT(report.percept.equal, 40u);
  EXPECT_GT(report.interest_points.equal, 40u);
  EXPECT_EQ(report.drag_field.without_inputs + report.percept.without_inputs, 0u);
}

TEST_F(RecordedSession, AlsoWithSensorsThatRemember) {
  config.percept.memory = {1.0, 0.5, 0.25};
  record();
  const ReplayReport report = replayed(config.percept);
  for (const auto& difference : report.differences) ADD_FAILURE() << difference;
  EXPECT_TRUE(report.ok());
}

TEST_F(RecordedSession, AlsoOfAnArmWhoseFingersMove) {
  model.skin.closing_m.assign(model.skin.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = model.skin.first[7]; i < model.skin.first[8]; ++i) model.skin.closing_m[i].x() = 0.05;
  record();
  const ReplayReport report = replayed(config.percept);
  for (const auto& difference : report.differences) ADD_FAILURE() << difference;
  EXPECT_TRUE(report.ok());
  EXPECT_GT(report.drag_field.equal, 350u);
  EXPECT_GT(report.percept.equal, 40u);
}

TEST_F(RecordedSession, AlsoWithWhatTheArmCarriedForAWhile) {
  carries = true;
  model.name = "left";
  model.skin_options.voxel_size_m = 0.01;
  config.percept.memory = {1.0, 0.5, 0.25};
  record();
  const ReplayReport report = replayed(config.percept);
  for (const auto& difference : report.differences) ADD_FAILURE() << difference;
  EXPECT_TRUE(report.ok());
  EXPECT_GT(report.drag_field.equal, 350u);
  EXPECT_EQ(report.drag_field.without_inputs, 0u);
  model.name = "right";
  EXPECT_FALSE(replayed(config.percept).ok()) << "the pump is felt";
}

TEST_F(RecordedSession, OtherParametersAreFound) {
  record();
  PerceptSettings other = config.percept;
  other.cluster_reach_vox += 1;
  const ReplayReport report = replayed(other);
  EXPECT_FALSE(report.ok());
  EXPECT_GT(report.percept.different, 0u);
  ASSERT_FALSE(report.differences.empty());
  EXPECT_THAT(report.differences[0], testing::HasSubstr("percept"));
}

TEST_F(RecordedSession, LostSamplesAreToldAndTheRestStaysEqual) {
  int count = 0;
  record([&](const std::string& topic) {
    return topic != "percept" && topic != "interest_points" && ++count % 9 == 0;
  });
  const ReplayReport report = replayed(config.percept);
  EXPECT_TRUE(report.ok());
  EXPECT_GT(report.drag_field.without_inputs, 10u);
}

TEST_F(RecordedSession, AFileThatIsNotThereIsNamed) {
  EXPECT_THROW(replayed(config.percept), core::MissingError);
}

}  // namespace
}  // namespace phantom::phantom_sensing
