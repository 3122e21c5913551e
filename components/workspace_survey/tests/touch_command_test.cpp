// The command `touch` against a system that a test plays: an arm that touches by script, and a server that
// does what it is asked or refuses.
#include "components/workspace_survey/touch_command.hpp"

#include <gmock/gmock.h>
#include <zstd.h>

#include <Eigen/Geometry>
#include <atomic>
#include <chrono>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/publisher.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/process/process.hpp"
#include "components/workspace_survey/tests/rig.hpp"

namespace phantom::workspace_survey {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr std::uint16_t kPlayedId = 2;  // of the fixture

/// Publishes the bench's fixture, and an arm's states that touch it again and again where it really is.
class PlayedSystem {
 public:
  PlayedSystem(const core::NetworkOptions& network, const runtime::CellConfig& cell)
      : arm_(runtime::load_arm(cell.arm())),
        model_WO_(cell.objects.at(1).X_WO),
        real_WO_(model_WO_ * cell.objects.at(1).X_deviation),
        participant_("played_system", network),
        objects_(participant_, dds::kWorkspaceObject),
        chunks_(participant_, dds::kMeshChunk),
        states_(participant_, dds::kSlaveState),
        replies_(participant_, dds::kWorkspaceReply),
        commands_(participant_, dds::kWorkspaceCommand,
                  [this](const msg::WorkspaceCommand& message, const dds::SampleInfo&) { answer(message); }) {
    publish_mesh();
    publish_object(model_WO_);
    player_ = std::jthread([this](const std::stop_token& stop) { play(stop); });
  }

  std::vector<messages::WorkspaceCommand> commands() {
    const std::lock_guard lock(mutex_);
    return done_;
  }
  const geometry::Pose& model_WO() const { return model_WO_; }
  const geometry::Pose& real_WO() const { return real_WO_; }
  void refuse() { refuses_ = true; }
  /// The tip stays 15 mm inside the model, and touches nothing.
  void hover() { hovers_ = true; }
  /// Someone moves the object in the model after so many touches.
  void move_after(int touches, const Eigen::Vector3d& by_m) { move_after_ = touches, move_by_m_ = by_m; }

 private:
  void publish_mesh() {
    const auto bytes = geometry::mesh_bytes(mesh_O_);
    messages::MeshChunk chunk{.mesh_hash = mesh_O_.content_hash(), .chunk_count = 1};
    chunk.vertex_count = static_cast<std::uint32_t>(mesh_O_.vertices_m.size());
    chunk.triangle_count = static_cast<std::uint32_t>(mesh_O_.triangles.size());
    chunk.data.resize(ZSTD_compressBound(bytes.size()));
    chunk.data.resize(ZSTD_compress(chunk.data.data(), chunk.data.size(), bytes.data(), bytes.size(), 3));
    chunks_.write(messages::to_idl(chunk));
  }
  void publish_object(const geometry::Pose& X_WO) {
    messages::WorkspaceObject object;
    object.id = kPlayedId;
    object.name = "fixture";
    object.mesh_hash = mesh_O_.content_hash();
    object.X_WO = X_WO;
    objects_.write(messages::to_idl(object));
  }
  void answer(const msg::WorkspaceCommand& message) {
    const auto command = messages::from_idl(message);
    if (!command) return;
    messages::WorkspaceReply reply;
    reply.command = command->stamp;
    reply.requester = command->requester;
    reply.object = command->object;
    reply.id = kPlayedId;
    const std::lock_guard lock(mutex_);
    const bool is_new = done_.empty() || !(done_.back().stamp == command->stamp);
    if (is_new) done_.push_back(*command);
    reply.outcome = refuses_ ? messages::WorkspaceOutcome::kRefused : messages::WorkspaceOutcome::kDone;
    reply.message = refuses_ ? "this server refuses" : "moved 'fixture'";
    reply.version = refuses_ ? 0 : 7;
    if (is_new && !refuses_) served_WO_ = command->X_WO;
    waiting_.push_back(reply);
  }

  /// Where a ray from outside through a place of the model meets the real face.
  std::pair<Eigen::Vector3d, Eigen::Vector3d> met(int spot) const {
    struct Spot {
      Eigen::Vector3d at_O_m, normal_O;
    };
    const Eigen::Vector3d up(0, 0, 1), front(0, -1, 0), end(-1, 0, 0);
    const Spot spots[] = {{{-0.033, -0.010, 0.03}, up}, {{0.033, -0.010, 0.03}, up},
                          {{0.0, 0.012, 0.03}, up},     {{-0.033, -0.04, 0.0}, front},
                          {{0.033, -0.04, 0.0}, front}, {{-0.06, 0.0, 0.0}, end}};
    const Spot& s = spots[spot % 6];
    const Eigen::Vector3d normal_W = real_WO_.rotation * s.normal_O,
                          way_W = -(model_WO_.rotation * s.normal_O);
    const Eigen::Vector3d from_W = model_WO_ * s.at_O_m - 0.05 * way_W;
    return {from_W + way_W * normal_W.dot(real_WO_ * s.at_O_m - from_W) / normal_W.dot(way_W), normal_W};
  }

  /// Publishes what commands have changed, and the answers to them.
  void serve(int touch) {
    std::unique_lock lock(mutex_);
    if (move_after_ > 0 && touch >= move_after_) {
      move_after_ = 0;
      served_WO_ = geometry::Pose{now_WO_.rotation, now_WO_.translation_m + move_by_m_};
    }
    const auto moved_to = std::exchange(served_WO_, std::nullopt);
    if (moved_to) now_WO_ = *moved_to;
    const auto replies = std::exchange(waiting_, {});
    lock.unlock();
    if (moved_to) publish_object(*moved_to);
    for (const auto& reply : replies) replies_.publish(reply);
  }

  void play(const std::stop_token& stop) {
    constexpr int kFree = 75, kTouch = 40;  // states, 2 ms apart
    for (int tick = 0; !stop.stop_requested(); ++tick) {
      const int touch = tick / (kFree + kTouch);
      messages::SlaveState state;
      state.joint_count = 5;
      state.position = {0.36, 0.338, hovers_ ? 0.055 : 0.2};
      state.force_measured = true;
      state.contact_force_N = 0.0;
      if (!hovers_ && tick % (kFree + kTouch) >= kFree) {
        const auto [p_W_m, normal_W] = met(touch);
        robot::LinkPoses X_WL;
        arm_.link_poses(state.position, X_WL);
        arm_.add_force(5, p_W_m, 3.0 * normal_W, X_WL, state.external_torque_Nm);
        state.contact = true;
        state.contact_force_N = 3.0;
        state.contact_object = kPlayedId;
        state.contact_point_m = messages::vector_of(p_W_m);
      }
      states_.publish(state);
      serve(touch);
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

  robot::SerialArm arm_;
  geometry::TriangleMesh mesh_O_ = geometry::make_box({0.12, 0.08, 0.06});
  geometry::Pose model_WO_, real_WO_;
  std::mutex mutex_;
  geometry::Pose now_WO_ = model_WO_;
  std::optional<geometry::Pose> served_WO_;  // not published yet
  std::vector<messages::WorkspaceCommand> done_;
  std::vector<messages::WorkspaceReply> waiting_;
  std::atomic<bool> refuses_{false}, hovers_{false};
  int move_after_ = 0;
  Eigen::Vector3d move_by_m_ = Eigen::Vector3d::Zero();
  dds::Participant participant_;
  dds::Writer<msg::WorkspaceObject> objects_;
  dds::Writer<msg::MeshChunk> chunks_;
  messages::Publisher<messages::SlaveState> states_;
  messages::Publisher<messages::WorkspaceReply> replies_;
  dds::Reader<msg::WorkspaceCommand> commands_;
  std::jthread player_;
};

class TouchCommand : public testing::Test {
 protected:
  /// `workspace_survey touch …` as a person would type it, who answers what it asks.
  std::string touch(const std::string& answer = "") {
    std::istringstream in(answer);
    std::ostringstream print;
    exit_code_ = run_touch(request_, config_, workspace_, in, print);
    return print.str();
  }
  static double off_m(const geometry::Pose& a, const geometry::Pose& b) {
    const survey::TouchSurface surface(geometry::make_box({0.12, 0.08, 0.06}));
    double worst_m = 0.0;
    for (const Eigen::Vector3d& p : surface.extremes_O_m())
      worst_m = std::max(worst_m, (a * p - b * p).norm());
    return worst_m;
  }

  const Config config_ = shipped_config();
  const Workspace workspace_{dds::test_network(), 0.005,
                             runtime::load_cell(source("deploy/cells/touch_bench/cell.yaml"))};
  PlayedSystem system_{workspace_.network, workspace_.cell};
  Request request_{.what = "touch", .timeout_s = 30.0, .object = "fixture", .wait_s = 20.0};
  int exit_code_ = -1;
};

TEST_F(TouchCommand, ShowsTheChangeWidensTheGuardAndAppliesWhatIsAgreedTo) {
  const std::string said = touch("y\n");
  EXPECT_EQ(exit_code_, runtime::kExitDone) << said;
  EXPECT_THAT(said, AllOf(HasSubstr("touch 6"), HasSubstr("the model is contradicted: its guard is"),
                          HasSubstr("apply this change? [y/N]"),
                          HasSubstr("workspace:   moved 'fixture'\nversion 7\n"), Not(HasSubstr("refused"))));
  const auto commands = system_.commands();
  ASSERT_GE(commands.size(), 2u);
  EXPECT_LT(off_m(commands.front().X_WO, system_.model_WO()), 1e-9) << "only its guard";
  EXPECT_GE(commands.front().guard_vox.value_or(0), 3) << "12 mm and what is unknown, in voxels of 5 mm";
  EXPECT_LT(off_m(commands.back().X_WO, system_.real_WO()), 0.002) << said;
  EXPECT_LT(commands.back().guard_vox.value_or(100), commands.front().guard_vox.value_or(0));
  EXPECT_GE(5 * commands.back().guard_vox.value_or(0), 1e3 * off_m(commands.back().X_WO, system_.real_WO()));
}

TEST_F(TouchCommand, WithoutAYesTheGuardStaysAndThePoseToo) {
  request_.touches = 4;  // so many, wherever it begins: not the top alone, where the model is right
  const std::string said = touch("no\n");
  EXPECT_EQ(exit_code_, runtime::kExitDone) << said;
  EXPECT_THAT(said, AllOf(HasSubstr("not applied; the guard stays at"), HasSubstr("open:")));
  for (const auto& command : system_.commands()) EXPECT_LT(off_m(command.X_WO, system_.model_WO()), 1e-9);
}

TEST_F(TouchCommand, JsonIsAllThatIsPrintedAndSaysWhatIsOpen) {
  request_.touches = 4;
  request_.json = "-";
  request_.apply = true;
  const auto json = nlohmann::json::parse(touch());
  EXPECT_EQ(exit_code_, runtime::kExitDone);
  EXPECT_TRUE(json.at("applied"));
  EXPECT_EQ(json.at("touches").size(), 4u);
  EXPECT_GE(json.at("open").size(), 2u);
  EXPECT_THAT(json.at("open").dump(), HasSubstr("of W"));
  EXPECT_EQ(json.at("covariance").size(), 6u);
  EXPECT_GT(json.at("worst_point_off_m"), 0.002) << "what is open is covered";
}

TEST_F(TouchCommand, NoContactWhereTheModelHasOneWidensTheGuardAndDeterminesNothing) {
  system_.hover();
  request_.tip_radius_mm = 2.0;
  request_.wait_s = 1.5;
  request_.apply = true;
  const std::string said = touch();
  EXPECT_EQ(exit_code_, runtime::kExitFailed) << said;
  EXPECT_THAT(said, AllOf(HasSubstr("no contact   at (0.0000 0.0000 0.2450) m, inside the model"),
                          HasSubstr("the model is contradicted: its guard is"),
                          HasSubstr("refused:     the touches determine nothing yet")));
  ASSERT_EQ(system_.commands().size(), 1u);
  EXPECT_LT(off_m(system_.commands()[0].X_WO, system_.model_WO()), 1e-9);
  EXPECT_GE(system_.commands()[0].guard_vox.value_or(0), 4) << "17 mm at least, in voxels of 5 mm";
}

// Tries workspace_survey: the object is moved by another while it is touched
TEST_F(TouchCommand, AnObjectThatIsMovedMeanwhileIsHeldAgainstItsNewPose) {
  system_.move_after(3, {0.0, 0.003, 0.0});
  request_.apply = true;
  const std::string said = touch();
  EXPECT_EQ(exit_code_, runtime::kExitDone) << said;
  EXPECT_THAT(said, HasSubstr("the object was moved in the workspace meanwhile"));
  EXPECT_LT(off_m(system_.commands().back().X_WO, system_.real_WO()), 0.002) << said;
}

// Tries workspace_survey: the server refuses
TEST_F(TouchCommand, AServerThatRefusesIsRepeatedAndEndsWithOne) {
  system_.refuse();
  request_.apply = true;
  const std::string said = touch();
  EXPECT_EQ(exit_code_, runtime::kExitFailed);
  EXPECT_THAT(said, AllOf(HasSubstr("the guard is not widened: this server refuses"),
                          HasSubstr("workspace refused: this server refuses")));
}

}  // namespace
}  // namespace phantom::workspace_survey
