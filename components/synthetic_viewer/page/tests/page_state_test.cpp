#include "components/synthetic_viewer/page/page_state.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "common/geometry/implicit/primitives.hpp"
#include "common/messages/living.hpp"
#include "components/synthetic_viewer/state/inbox.hpp"
#include "components/synthetic_viewer/stream/state_delta.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr core::Nanoseconds kPage_ns = 20 * core::kNsPerSecond;

CellScene make_scene() {
  // Tests run side by side: a file of this process's own.
  const std::filesystem::path file =
      std::filesystem::path(::testing::TempDir()) / ("viewer_page_arm_" + std::to_string(getpid()) + ".urdf");
  std::ofstream(file) << R"(<robot name="a"><link name="base"/><link name="one"/>
    <joint name="lift" type="prismatic"><parent link="base"/><child link="one"/><axis xyz="0 0 1"/>
    <limit lower="-0.4" upper="0.6" velocity="1" effort="1"/></joint></robot>)";
  auto arm = robot::SerialArm::from_urdf(file, "one", {});
  if (!arm) throw std::runtime_error(arm.status().message());
  return {std::move(arm).value(), {0, 0, 0}, {1, 1, 1}, "left"};
}

nlohmann::json page_of(const CellScene& scene, const ViewerState& state, const HitView& view = {}) {
  const PageFacts facts{"test cell", true, false, 9.9, "none", kPage_ns - 7 * core::kNsPerSecond, {}};
  return page_state(state, scene, view, {}, facts, kPage_ns);
}
nlohmann::json page(const ViewerState& state, const HitView& view = {}) {
  return page_of(make_scene(), state, view);
}

TEST(PageState, SaysThatNothingIsKnownAtTheStart) {
  const auto json = page({});
  EXPECT_EQ(json.at("t"), 7.0);
  EXPECT_EQ(json.at("link").at("slave"), "NONE");
  EXPECT_TRUE(json.at("link").at("slave_age_s").is_null());
  EXPECT_TRUE(json.at("percept").at("closeness").is_null());
  EXPECT_FALSE(json.at("percept").at("known"));
  EXPECT_EQ(json.at("joints").at("name").dump(), R"(["lift"])");
  EXPECT_TRUE(json.at("joints").at("prismatic")[0]);
  EXPECT_NE(json.at("banner").get<std::string>(), "");
}

TEST(PageState, StalePerceptIsNotShownAsAValue) {
  ViewerState state;
  state.percept.received_ns = kPage_ns - 5 * core::kNsPerSecond;
  state.percept.valid = true;
  state.percept.closeness = 0.7;
  EXPECT_TRUE(page(state).at("percept").at("closeness").is_null());
  state.percept.received_ns = kPage_ns;
  EXPECT_EQ(page(state).at("percept").at("closeness"), 0.7);
  EXPECT_FALSE(page(state).at("percept").at("unseen"));
  state.percept.condition = messages::PerceptCondition::kSpaceUnseen;
  EXPECT_TRUE(page(state).at("percept").at("unseen"));
}

TEST(PageState, SR23_TellsWhereTheModelIsInDoubtAndWhatWouldExplainIt) {
  ViewerState state;
  state.take(ObjectSample{.id = 3, .name = "pump", .mesh_hash = 1}, kPage_ns);
  DoubtSample doubt;
  doubt.place = 5;
  doubt.stamp = {1, 2, 9};
  doubt.doubt = 4;
  doubt.holds = true;
  doubt.link_name = "gripper";
  doubt.object = 3;
  doubt.located = true;
  doubt.force_N = 12.4;
  doubt.residual_known = true;
  doubt.residual_m = 0.031;
  doubt.shift_m = {0.0, 0.031, 0.0};
  state.take(doubt);
  nlohmann::json json = page(state).at("doubts").at("5");
  EXPECT_EQ(json.at("number"), 4);
  EXPECT_TRUE(json.at("holds"));
  EXPECT_NEAR(json.at("residual_m").get<double>(), 0.031, 1e-9);
  EXPECT_NEAR(json.at("shift_m").get<double>(), 0.031, 1e-9);
  EXPECT_EQ(english_text(doubt_words(state, doubt)), "force of 12 N at gripper, 31 mm from pump");
  EXPECT_EQ(in(Language::kGerman, doubt_words(state, doubt)), "Kraft von 12 N an gripper, 31 mm neben pump");
  doubt.residual_known = doubt.located = false;
  doubt.force_N = -1.0;
  EXPECT_EQ(english_text(doubt_words(state, doubt)),
            "a force on gripper or behind it, where the model has nothing");
  doubt.kind = percept::DoubtKind::kNoForceInside;
  doubt.residual_m = -0.025;
  EXPECT_EQ(english_text(doubt_words(state, doubt)), "no force at gripper, which is 25 mm inside pump");
  doubt.stamp.session = 10;  // the phantom was started again
  doubt.place = 0;
  state.take(doubt);
  EXPECT_EQ(page(state).at("doubts").size(), 1U);
  EXPECT_TRUE(page(state).at("doubts").contains("0"));
}

TEST(PageState, SR28_TellsWhichObjectsDoNotStandWhereTheModelHasThem) {
  ViewerState state;
  state.take(ObjectSample{.id = 3, .name = "pump", .mesh_hash = 1}, kPage_ns);
  FindingSample finding{.id = 3, .verdict = messages::PoseVerdict::kElsewhere, .camera = "above"};
  finding.shift_m = 0.1;
  finding.turn_rad = 0.2;
  finding.residual_m = 0.003;
  finding.unseen = "along z";
  state.take(finding);
  const nlohmann::json json = page(state).at("findings").at("pump");
  EXPECT_EQ(json.at("shift_m"), 0.1);
  EXPECT_EQ(json.at("turn_rad"), 0.2);
  EXPECT_EQ(json.at("residual_m"), 0.003);
  EXPECT_EQ(json.at("unseen"), "along z");
  EXPECT_EQ(english_text(finding_words(state, finding)),
            "pump stands 100 mm from where the model has it (camera above)");
  finding.verdict = messages::PoseVerdict::kGone;
  state.take(finding);
  EXPECT_TRUE(page(state).at("findings").at("pump").at("shift_m").is_null());
  EXPECT_EQ(in(Language::kGerman, finding_words(state, finding)),
            "pump ist nicht mehr an seinem Ort im Modell (Kamera above)");
  finding.verdict = messages::PoseVerdict::kAgrees;
  state.take(finding);
  EXPECT_TRUE(page(state).at("findings").empty());
  finding.verdict = messages::PoseVerdict::kUnclear;
  state.take(finding);
  EXPECT_EQ(page(state).at("findings").size(), 1U);
  ObjectSample moved{.id = 3, .name = "pump", .mesh_hash = 1};
  moved.X_WO.translation_m.x() = 0.1;
  state.take(moved, kPage_ns);
  EXPECT_TRUE(page(state).at("findings").empty()) << "it was moved since";
}

TEST(PageState, TellsWhatCamerasSeeAndTheModelLacksAndWhatWasDecided) {
  ViewerState state;
  constexpr std::uint16_t kThing = messages::kFirstLiveObjectId + 1;
  state.take(ObjectSample{.id = kThing, .name = "live object 2", .mesh_hash = 1}, kPage_ns);
  state.take(LiveObjectSample{kThing, messages::LiveStanding::kTracked, "live object 2"});
  nlohmann::json json = page(state);
  EXPECT_EQ(json.at("live").at("live object 2").at("standing"), "tracked");
  EXPECT_TRUE(json.at("objects").empty()) << "no arm can take it";
  state.take(LiveObjectSample{kThing, messages::LiveStanding::kDiscarded, "glare"});
  json = page(state).at("live");
  ASSERT_EQ(json.size(), 1U);
  EXPECT_EQ(json.at("glare").at("standing"), "discarded");
  EXPECT_EQ(json.at("glare").at("what_words").at("key"), "live.discarded");
  state.take(LiveObjectSample{7, messages::LiveStanding::kTracked, "no id of theirs"});
  EXPECT_EQ(page(state).at("live").size(), 1U);
  state.take(LiveObjectSample{kThing, messages::LiveStanding::kLost, "glare"});
  EXPECT_TRUE(page(state).at("live").empty());
}

TEST(PageState, SR28_TheBannerNamesADisplacedObjectWhileItLeadsThePercept) {
  constexpr Staleness kStaleness;
  ViewerState state;
  state.take(ObjectSample{.id = 3, .name = "pump", .mesh_hash = 1}, kPage_ns);
  state.take(FindingSample{.id = 3, .verdict = messages::PoseVerdict::kGone, .camera = "above"});
  state.arm.received_ns = state.percept.received_ns = state.master.received_ns = kPage_ns;
  state.arm.state = LinkState::kCoupled;
  state.arm.motion_permitted = state.master.motion_permitted = true;
  state.percept.valid = true;
  state.percept.object = 4;
  EXPECT_TRUE(condition_words(state, kStaleness, kPage_ns).key.empty());
  state.percept.object = 3;
  EXPECT_EQ(english_text(condition_words(state, kStaleness, kPage_ns)),
            "MODEL IN DOUBT: pump is gone from where the model has it (camera above)");
}

TEST(CellScene, AnObjectThatMayBeOffIsDrawnTwice) {
  CellScene scene = make_scene();
  MeshBody mesh;
  mesh.picture = kFirstFreeHandle;
  mesh.box = geometry::make_box({0.2, 0.1, 0.04}).bounding_box();
  scene.meshes[1] = mesh;
  ViewerState state;
  state.take(ObjectSample{.id = 3, .name = "pump", .mesh_hash = 1}, kPage_ns);
  EXPECT_EQ(scene.items(state, {}, kPage_ns).size(), 1U);
  state.uncertainties[3] = {3, -1.0, 0.0};
  EXPECT_EQ(scene.items(state, {}, kPage_ns).size(), 1U) << "not stated";
  state.uncertainties[3] = {3, 0.0004, 0.005};
  EXPECT_EQ(scene.items(state, {}, kPage_ns).size(), 1U) << "too little to be seen";
  state.uncertainties[3] = {3, 0.012, 0.015};
  const auto items = scene.items(state, {}, kPage_ns);
  ASSERT_EQ(items.size(), 2U);
  EXPECT_EQ(items[1].kind, SceneItem::Kind::kBound);
  EXPECT_NE(key_of(items[0]), key_of(items[1]));
  EXPECT_EQ(items[1].grown_m, 0.012);
  EXPECT_LT(items[1].opacity, 0.5F);
  EXPECT_FALSE(items[1].casts_shadow);
}

TEST(PageState, TellsWhichChangeOfTheModelWouldBeUndone) {
  ViewerState state;
  EXPECT_TRUE(page(state).at("model").at("undo").is_null());
  ObjectSample object{.id = 3, .name = "pump", .mesh_hash = 1};
  state.take(object, kPage_ns);
  object.X_WO.translation_m.x() += 0.02;
  state.take(object, kPage_ns);
  EXPECT_EQ(page(state).at("model").at("undo").at("object"), "pump");
  EXPECT_NEAR(page(state).at("model").at("undo").at("moved_m").get<double>(), 0.02, 1e-9);
}

TEST(PageState, TellsTheThreeMostUrgentThreatsWithTheirSecondsAndHowManyThereAre) {
  ViewerState state;
  state.objects[3] = {.id = 3, .name = "pump"};
  state.percept.received_ns = kPage_ns;
  state.percept.valid = true;
  for (int i = 0; i < 5; ++i) {
    messages::Threat threat;
    threat.rule = percept::HitRule::kFarNearing;
    threat.link = 1;
    threat.object = 3;
    threat.contact = {0.5 + i, i == 0 ? 0.0614 : -1.0, i == 0 ? 0.0521 : -1.0};
    state.percept.threats.push_back(threat);
  }
  state.percept.threats[2].contact.time_s = -1.0;
  nlohmann::json percept = page(state).at("percept");
  EXPECT_EQ(percept.at("threat_count"), 5);
  ASSERT_EQ(percept.at("threats").size(), 3U);
  const nlohmann::json first = percept.at("threats")[0], third = percept.at("threats")[2];
  EXPECT_EQ(first.at("link"), "one");
  EXPECT_EQ(first.at("object_words").at("values").at("name"), "pump");
  EXPECT_EQ(first.at("contact_s"), 0.5);
  EXPECT_EQ(first.at("error_s"), 0.061);
  EXPECT_EQ(first.at("gap_m"), 0.052);
  EXPECT_EQ(first.at("rule"), "far_nearing");
  EXPECT_TRUE(third.at("contact_s").is_null()) << "it does not near";
  state.percept.received_ns = kPage_ns - 5 * core::kNsPerSecond;
  percept = page(state).at("percept");
  EXPECT_TRUE(percept.at("threats").empty()) << "a stale percept tells of no threat";
  EXPECT_EQ(percept.at("threat_count"), 0);
}

TEST(PageState, AnAlertTellsWhereItIsAndTheModelHowLargeTheCellIs) {
  ViewerState state;
  HitSample hit;
  hit.received_ns = kPage_ns;
  hit.alert = 4;
  hit.object = 3;
  hit.look_at_m = {0.1, 0.25, 0.5};
  hit.pgv = {0, -0.02, 0};
  hit.contact.time_s = 0.42;
  state.take(hit);
  const nlohmann::json json = page(state), shown = json.at("hits").at("1");
  EXPECT_EQ(shown.at("at_m").dump(), "[0.1,0.25,0.5]");
  EXPECT_EQ(shown.at("towards").dump(), "[0.0,-0.02,0.0]");
  EXPECT_EQ(shown.at("contact_s"), 0.42);
  EXPECT_EQ(shown.at("object_id"), 3);
  EXPECT_EQ(json.at("model").at("max_m").dump(), "[1.0,1.0,1.0]");
  EXPECT_EQ(json.at("view").at("directions").size(), 15U);
  EXPECT_EQ(json.at("limits_words")[0].at("key"), "limit.arm_silent");
  EXPECT_TRUE(json.at("delay").at("sensing").at("age_s").is_null());
}

TEST(PageState, SaysInPlainWordsWhatTheGripperDoes) {
  ViewerState state;
  EXPECT_TRUE(page(state).at("gripper").is_null()) << "there is none";
  GripperSample& gripper = state.gripper;
  gripper.received_ns = kPage_ns;
  gripper.sense = {true, 0.0418, 0.0, 29.6, true, false};
  gripper.widest_m = 0.1;
  gripper.requested_force_N = 30.0;
  gripper.holds = true;
  const auto words = [&] { return page(state).at("gripper").at("words").get<std::string>(); };
  EXPECT_EQ(words(), "holds something 42 mm wide with 30 N");
  EXPECT_EQ(page(state).at("gripper").at("width_m"), 0.0418);
  EXPECT_EQ(page(state).at("gripper").at("requested_force_N"), 30.0);
  gripper.received_ns = kPage_ns - 3 * core::kNsPerSecond;
  EXPECT_EQ(words(), "not heard for 3.0 s; it held something, and holds by itself");
  EXPECT_TRUE(page(state).at("gripper").at("width_m").is_null());
  gripper.received_ns = kPage_ns;
  gripper.sense.fault = true;
  EXPECT_EQ(words(), "its drive is in fault; it held something");
  gripper.holds = false;
  gripper.sense = {true, 0.063, -0.1, 1.0, true, false};
  gripper.moves = true;
  EXPECT_EQ(words(), "closes, at 63 mm");
  gripper.sense.velocity_m_s = 0.1;
  EXPECT_EQ(words(), "opens, at 63 mm");
  gripper.moves = false;
  EXPECT_EQ(words(), "at rest, 63 mm open");
  gripper.closed = true;
  EXPECT_EQ(words(), "closed");
  gripper.open = true;
  EXPECT_EQ(words(), "open, 63 mm");
  gripper.sense.follows = false;
  EXPECT_EQ(words(), "its drive is not ready yet, at 63 mm");
  gripper.sense.known = false;
  EXPECT_EQ(words(), "its drive has not reported yet");
}

/// The pump stands at x = 0.7 m, and the arm stands lifted by `lift_m`.
ViewerState state_with_pump(double lift_m, bool carried, const std::string& arm = "left") {
  ViewerState state;
  state.objects[3] = {
      .id = 3, .name = "pump", .mesh_hash = 9, .X_WO = {Eigen::Matrix3d::Identity(), {0.7, 0, 0}}};
  state.arm.received_ns = kPage_ns;
  state.arm.position[0] = lift_m;
  if (!carried) return state;
  messages::CarriedObject pump{.id = 3, .arm = arm, .frame = "one"};
  pump.X_FO.translation_m = {0.2, 0.0, -0.1};
  state.workspace.carried = {pump};
  return state;
}

TEST(CellScene, WhatTheArmCarriesMovesWithItsHandAndStandsInTheCellOtherwise) {
  CellScene scene = make_scene();
  scene.meshes[9] = {kFirstFreeHandle, std::make_shared<RayMesh>(geometry::make_box({0.1, 0.1, 0.1})), 12, 0};
  const auto drawn_at = [&](const ViewerState& state) {
    const Frame frame = scene.frame(state, {}, kPage_ns);
    EXPECT_EQ(frame.items.size(), 1U) << "once, wherever it is";
    return frame.items.empty() ? Eigen::Vector3f::Constant(9.0F)
                               : Eigen::Vector3f(frame.items[0].W_from_mesh.block<3, 1>(0, 3));
  };
  EXPECT_TRUE(drawn_at(state_with_pump(0.3, false)).isApprox(Eigen::Vector3f(0.7F, 0, 0)));
  EXPECT_TRUE(drawn_at(state_with_pump(0.3, true)).isApprox(Eigen::Vector3f(0.2F, 0, 0.2F)));
  EXPECT_TRUE(drawn_at(state_with_pump(0.5, true)).isApprox(Eigen::Vector3f(0.2F, 0, 0.4F)));
  ViewerState old = state_with_pump(0.3, true);
  old.arm.received_ns -= 5 * core::kNsPerSecond;
  EXPECT_LT(scene.frame(old, {}, kPage_ns).items.at(0).opacity, 1.0F) << "as the arm, whose pose is old";
  EXPECT_TRUE(scene.frame(state_with_pump(0.3, true, "right"), {}, kPage_ns).items.empty())
      << "where another arm has it is not known";
  EXPECT_EQ(scene.obstacles(state_with_pump(0.3, true), false).bodies.size(), 0U)
      << "it is a part of the arm";
  EXPECT_EQ(scene.obstacles(state_with_pump(0.3, true), true).bodies.size(), 1U);
  EXPECT_EQ(scene.obstacles(state_with_pump(0.3, false), false).bodies.size(), 1U);
}

TEST(CellScene, AProtectedZoneIsSeeThroughNoObstacleAndNothingToTake) {
  CellScene scene = make_scene();
  const geometry::TriangleMesh box = geometry::make_box({0.1, 0.1, 0.1});
  scene.meshes[9] = {kFirstFreeHandle, std::make_shared<RayMesh>(box), 12, 0};
  const ViewerState state = state_with_pump(0.3, false);  // at (0.7, 0, 0)
  const Eigen::Vector3d from_m(0.2, 0.0, 0.0), ahead(1.0, 0.0, 0.0);
  EXPECT_TRUE(scene.obstacles(state, true).nearest(from_m, ahead, 0.0, 1.0)) << "a body hides what is behind";
  EXPECT_TRUE(scene.frame(state, {}, kPage_ns).items.at(0).casts_shadow);
  EXPECT_EQ(page_of(scene, state).at("objects").size(), 1U);
  scene.zones = {3};
  const RayScene bodies = scene.obstacles(state, true);
  EXPECT_FALSE(bodies.nearest(from_m, ahead, 0.0, 1.0));
  EXPECT_NEAR(bodies.to_zone(3, from_m, ahead, 1.0).value_or(-1.0), 0.45, 1e-6);
  const DrawItem drawn = scene.frame(state, {}, kPage_ns).items.at(0);
  EXPECT_LT(drawn.opacity, 1.0F);
  EXPECT_FALSE(drawn.casts_shadow);
  const DrawItem over_video = scene.frame_over_video(state, {}, kPage_ns, {2, 0, 0}).items.at(0);
  EXPECT_FALSE(over_video.over_video) << "it is not in the picture, and hides nothing that is";
  EXPECT_EQ(page_of(scene, state).at("objects").size(), 0U);
}

TEST(PageState, SaysWhatIsCarriedByWhom) {
  EXPECT_EQ(page(state_with_pump(0.0, false)).at("carried"), "");
  EXPECT_EQ(page(state_with_pump(0.0, true)).at("carried"), "arm left carries pump");
  EXPECT_EQ(page(state_with_pump(0.0, true)).at("objects").dump(), R"([{"carried":true,"name":"pump"}])");
  EXPECT_EQ(page(state_with_pump(0.0, false)).at("objects")[0].at("carried"), false);
}

TEST(PageState, ASilentComponentIsSaidToBeSilent) {
  ViewerState state;
  ComponentSample component;
  component.component = "slave_io";
  component.received_ns = kPage_ns - core::kNsPerSecond / 2;
  component.state = core::ComponentState::kRunning;
  state.take(component);
  component.topics = {{.topic = "percept", .refused = 2}, {.topic = "hit_alert", .refused = 3}};
  state.take(component);
  const auto shown = [&] { return page(state).at("components").at("slave_io@"); };
  EXPECT_EQ(shown().at("state"), "RUNNING");
  EXPECT_EQ(shown().at("refused"), 5);
  component.received_ns = kPage_ns - 3 * core::kNsPerSecond;
  state.take(component);
  EXPECT_EQ(shown().at("state"), "SILENT");
}

TEST(PageState, TheRowOfTheTableIsSaidInWordsAndTheChoiceInSwitches) {
  ViewerState state;
  EXPECT_EQ(page(state).at("link").at("percepts"), "") << "no master";
  state.master.received_ns = kPage_ns;
  state.master.law = teleop::BilateralLaw::kSctfb;
  state.master.percept_enabled = true;
  state.master.views_enabled = false;
  state.arm.counterbalance = teleop::Counterbalance::kNone;
  EXPECT_EQ(page(state).at("link").at("percepts"), "Torque feedback, weight felt (b2): drag and tone");
  EXPECT_EQ(page(state).at("link").at("counterbalance"), "none");
  EXPECT_FALSE(page(state).at("link").at("views_enabled"));
  state.arm.counterbalance = teleop::Counterbalance::kAutomatic;
  state.master.views_enabled = true;
  EXPECT_EQ(page(state).at("link").at("percepts"),
            "Torque feedback, counterbalanced (b2): drag, tone and views");
  EXPECT_EQ(page(state).at("link").at("counterbalance"), "automatic");
}

TEST(PageState, HitsAreNumberedAsTheyCameAndToldWithTheirEnd) {
  ViewerState state;
  HitSample hit;
  hit.received_ns = kPage_ns - core::kNsPerSecond;
  hit.alert = 1;
  hit.link = 1;
  state.take(hit);
  hit.alert = 2;
  state.take(hit);
  hit.alert = 1;
  hit.cleared = true;
  hit.received_ns = kPage_ns;
  state.take(hit);
  const auto hits = page(state).at("hits");
  ASSERT_EQ(hits.size(), 2U);
  EXPECT_EQ(hits.at("2").at("alert"), 2);
  EXPECT_EQ(hits.at("2").at("number"), 2);
  EXPECT_TRUE(hits.at("2").at("cleared_after_s").is_null());
  EXPECT_EQ(hits.at("1").at("cleared_after_s"), 1.0);
  EXPECT_EQ(hits.at("1").at("link"), "one");
}

TEST(PageState, TheListOfHitsIsBounded) {
  ViewerState state;
  HitSample hit;
  for (std::uint32_t alert = 1; alert <= 500; ++alert) {
    hit.alert = alert;
    state.take(hit);
  }
  EXPECT_EQ(state.hits.size(), ViewerState::kMaxHits);
  EXPECT_EQ(state.total_hits, 500U);
  const auto told = page(state);
  EXPECT_EQ(told.at("total_hits"), 500);
  std::set<int> numbers;
  for (const auto& one : told.at("hits")) numbers.insert(one.at("number").get<int>());
  EXPECT_EQ(numbers.size(), ViewerState::kMaxHits);
  EXPECT_EQ(*numbers.rbegin(), 500);
  EXPECT_EQ(*numbers.begin(), 461) << "the newest ones";
}

TEST(PageState, NamesFromOutsideCannotBreakTheJson) {
  ViewerState state;
  ComponentSample component;
  component.component = "a\"b\n<script>\xFF";
  component.received_ns = kPage_ns;
  state.take(component);
  std::uint64_t seen = 0;
  StateDelta board;
  EXPECT_NO_THROW(board.put(page(state)));
  EXPECT_TRUE(nlohmann::json::accept(board.since(seen)));
}

// Tries synthetic_viewer: component_status under more than 256
TEST(ViewerStateBounds, TheComponentThatIsSilentLongestMakesRoom) {
  ViewerState state;
  ComponentSample sample;
  sample.component = "slave_io";
  for (int i = 0; i < 10'000; ++i) {
    sample.host = "invented_" + std::to_string(i);
    sample.received_ns = i + 1;
    state.take(sample);
    ASSERT_LE(state.components.size(), ViewerState::kMaxComponents);
  }
  EXPECT_TRUE(state.components.contains("slave_io@invented_9999"));
  EXPECT_FALSE(state.components.contains("slave_io@invented_0"));
  EXPECT_EQ(state.forgotten, 10'000 - ViewerState::kMaxComponents);
}

// Tries synthetic_viewer: more events come
TEST(InboxBounds, WhatWaitsIsBoundedByNumberAndMemoryAndTheRestIsCounted) {
  Inbox inbox;
  ComponentSample status;
  for (std::size_t i = 0; i < 2 * Inbox::kMaxStatuses; ++i)
    EXPECT_EQ(inbox.put(status), i < Inbox::kMaxStatuses);
  MeshChunkSample chunk;
  chunk.data.assign(std::size_t{256} << 10, 1);
  const std::size_t fit = Inbox::kMaxMeshBytes / chunk.data.size();
  for (std::size_t i = 0; i < fit + 100; ++i) ASSERT_EQ(inbox.put(chunk), i < fit);
  EXPECT_EQ(inbox.lost(), Inbox::kMaxStatuses + 100);
  HitSample hit;
  EXPECT_TRUE(inbox.put(hit));  // an alert is not behind any of them
  EXPECT_TRUE(inbox.urgent());
  EXPECT_EQ(inbox.take_hits().size(), 1U);
  EXPECT_EQ(inbox.take_events().size(), Inbox::kMaxStatuses + fit);
  EXPECT_TRUE(inbox.put(chunk));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
