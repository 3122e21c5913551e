#include "components/wva_server/wva_server.hpp"

#include <gmock/gmock.h>

#include <filesystem>

#include "common/runtime/configuration/fields.hpp"
#include "components/wva_server/change_under_way.hpp"
#include "components/wva_server/tests/test_cell.hpp"

namespace phantom::wva_server {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::ContainsRegex;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class WvaServer : public TestCell {
 protected:
  static std::string refusal(const std::filesystem::path& file) {
    try {
      runtime::load_bodies(runtime::load_cell(file), {});
    } catch (const runtime::ConfigError& error) {
      return error.what();
    }
    return "accepted";
  }
};

TEST_F(WvaServer, ActivatesEveryObjectWhereTheModelHasIt) {
  const LiveCell live = activated(cell(), 7);
  const workspace::Workspace& w = live.workspace();
  EXPECT_EQ(w.version, 7U);
  EXPECT_EQ(w.grid().size_vox, (std::array<std::int32_t, 3>{80, 80, 50}));
  EXPECT_EQ(order_at(w, 0.001, 0.001, 0.301), workspace::kOrderInterior);  // not at its real deviation
  EXPECT_EQ(order_at(w, 0.075, 0.001, 0.301), 1);
  EXPECT_EQ(order_at(w, -0.201, 0.101, 0.15), workspace::kOrderInterior);
  EXPECT_EQ(w.object(w.grid().index_of({-0.201, 0.101, 0.15})), 2);
  EXPECT_EQ(w.object(w.grid().index_of({0.201, 0.101, 0.15})), 3);
  EXPECT_EQ(order_at(w, 0.235, 0.105, 0.155), workspace::kOrderGuard);
  EXPECT_EQ(w.mu(w.grid().index_of({0.235, 0.105, 0.155})), 25.0F);
  EXPECT_THAT(w.palette(), testing::IsSupersetOf({0.F, 20.F, 25.F, 32.F, 90.F, 100.F}));
  EXPECT_EQ(live.content_hash(), w.content_hash());
  ASSERT_EQ(live.objects().size(), 3U);
  EXPECT_THAT(describe(live.objects().at(1)),
              AllOf(HasSubstr("ball (object 1)"), HasSubstr("1280 triangles")));
}

TEST_F(WvaServer, TheSameCellGivesTheSameWorkspace) {
  EXPECT_EQ(activated(cell()).content_hash(), activated(cell()).content_hash());
}

// Tries wva_server: a stop is requested while activating
TEST_F(WvaServer, TellsItsProgressAndEndsWhenAskedTo) {
  const auto loaded = runtime::load_cell(cell());
  LiveCell live(loaded, {});
  std::vector<std::size_t> done;
  const auto ended =
      live.activate(runtime::load_bodies(loaded, {}), 1, {.keep_going = [&] { return done.size() < 2; }},
                    [&](const ServedObject&, std::size_t n) { done.push_back(n); });
  EXPECT_THAT(done, ElementsAre(1, 2));
  EXPECT_FALSE(ended);  // nothing half-made
  EXPECT_TRUE(live.objects().empty());
  EXPECT_EQ(live.workspace().brick_count(), 0U);
}

// Tries wva_server: a mesh is not closed
TEST_F(WvaServer, SaysThatAMeshIsOpen) {
  std::string stl = ascii_stl(geometry::make_sphere(60, 3));
  const auto facet = stl.find("facet", stl.find("endfacet"));
  stl.erase(facet, stl.find("endfacet", facet) + 9 - facet);
  write("ball.stl", stl);
  const LiveCell live = activated(cell());
  EXPECT_FALSE(live.objects().at(1).report.mesh.closed);
  EXPECT_THAT(describe(live.objects().at(1)),
              ContainsRegex("not closed: .* its winding number decided on [0-9]+ voxels"));
}

// Tries wva_server: names triangles twice
TEST_F(WvaServer, SaysThatTrianglesCameTwice) {
  const std::string once = ascii_stl(geometry::make_sphere(60, 3));
  const auto facets = once.find("facet");
  const std::string first = once.substr(facets, once.find("endfacet") + 9 - facets);
  write("ball.stl", std::string(once).insert(facets, first + first));
  const LiveCell live = activated(cell());
  EXPECT_THAT(describe(live.objects().at(1)), HasSubstr("2 triangles came twice and were left out"));
  write("ball.stl", once);
  EXPECT_EQ(live.content_hash(), activated(cell()).content_hash());
}

// Tries wva_server: garbage
TEST_F(WvaServer, RefusesAMeshThatIsNone) {
  write("post.stl", "this is no mesh");
  EXPECT_THAT(refusal(cell()),
              AllOf(HasSubstr("cell.yaml"), HasSubstr("'left post'"), HasSubstr("post.stl")));
}

// Tries wva_server: with all its layers: wrong unit; wrong pose
TEST_F(WvaServer, RefusesAnObjectOutsideOfTheWorkspace) {
  EXPECT_THAT(
      refusal(cell_with("xyz_m: [0.2, 0.1, 0.15]", "xyz_m: [2.0, 0.1, 0.15]")),
      AllOf(HasSubstr("'right post'"), HasSubstr("outside of the workspace"), HasSubstr("x 1.98 to 2.02")));
}

TEST_F(WvaServer, AcceptsAnObjectOutsideWhoseLayersReachIn) {
  EXPECT_EQ(refusal(cell_with("xyz_m: [0.2, 0.1, 0.15]", "xyz_m: [0.43, 0.1, 0.15]")), "accepted");
}

// Tries wva_server: wrong unit
TEST_F(WvaServer, RefusesAMeshInTheWrongUnit) {
  EXPECT_THAT(refusal(cell_with("mesh_scale: 0.001, pose: {xyz_m: [-0.2, 0.1, 0.15]",
                                "mesh_scale: 1, pose: {xyz_m: [900.0, 0.1, 0.15]")),
              AllOf(HasSubstr("'left post'"), HasSubstr("mesh_scale")));
}

// Tries wva_server: in several usual units; in none
TEST_F(WvaServer, TakesAMeshWithoutUnitInTheOnlyUsualUnitInWhichItFits) {
  const auto cell_of_post = [&](const Eigen::Vector3d& size) {
    write("post.stl", ascii_stl(geometry::make_box(size)));
    return cell_with("mesh_scale: 0.001, pose: {xyz_m: [-0.2", "pose: {xyz_m: [-0.2");
  };
  const auto loaded = runtime::load_bodies(runtime::load_cell(cell_of_post({40, 40, 300})), {});
  EXPECT_NEAR(loaded[1].mesh_O.bounding_box().max_m.z(), 0.15, 1e-6);
  EXPECT_THAT(loaded[1].notes,
              testing::Contains(HasSubstr("declares no unit: millimetres are assumed, the only usual unit")));
  EXPECT_THAT(loaded[1].notes, testing::Not(testing::Contains(HasSubstr("plausible"))));
  EXPECT_THAT(
      refusal(cell_of_post({4, 4, 30})),
      AllOf(HasSubstr("'left post': mesh_scale: is missing, and "), HasSubstr("post.stl declares no unit"),
            HasSubstr("0.01 (centimetres, 0.0546 × 0.0546 × 0.3 m), 0.001 (millimetres, ")));
  EXPECT_THAT(refusal(cell_of_post({1e5, 1, 1})), HasSubstr("neither as metres nor as centimetres"));
}

// Tries wva_server: more than 255 different μ in the cell
TEST_F(WvaServer, RefusesMoreViscositiesThanThereAreCodes) {
  const auto with_balls = [&](int count) {  // of 90 layers each
    std::string balls;
    for (int k = 1; k <= count; ++k) {
      std::string thickness, mu;
      for (int i = 0; i < 90; ++i) thickness += "1, ", mu += std::to_string(1000 * k - i) + ", ";
      balls += "  - {name: ball" + std::to_string(k) + ", primitive: {sphere: {radius_m: 0.05}}, pose: " +
               "{xyz_m: [0, 0, 0.2]}, profile: {thickness_vox: [" + thickness + "], mu_Pa_s_per_m: [" + mu +
               "], mu_skin_Pa_s_per_m: 5000}}\n";
    }
    return refusal(cell_with("arms:", balls + "arms:"));
  };
  EXPECT_EQ(with_balls(2), "accepted");
  EXPECT_THAT(with_balls(3), AllOf(HasSubstr("cell.yaml: objects: "), HasSubstr("allowed: 1 to 256")));
}

// What commands do, with everything as before where they are refused.
class Commands : public WvaServer {
 protected:
  void SetUp() override {
    WvaServer::SetUp();
    live_.emplace(activated(cell(), 7));
    hash_ = live_->content_hash();
  }
  core::Expected<CellChange> apply(const WorkspaceCommand& command) { return live_->apply(command, 8, {}); }
  std::string refused(const WorkspaceCommand& command) {
    const auto change = apply(command);
    EXPECT_EQ(live_->workspace().version, change ? 8U : 7U);
    if (change) return "accepted";
    EXPECT_EQ(live_->content_hash(), hash_);
    EXPECT_EQ(live_->workspace().content_hash(), hash_);
    EXPECT_EQ(live_->objects().size(), 3U);
    return change.status().message();
  }
  std::uint64_t hash_of(const std::filesystem::path& file) { return activated(file).content_hash(); }
  static WorkspaceCommand add(const std::string& yaml) {
    return make_command(WorkspaceOperation::kAdd, "", 0, {}, yaml);
  }
  static WorkspaceCommand move(const std::string& object, const Eigen::Vector3d& to_m) {
    return make_command(WorkspaceOperation::kMove, object, 0, {Eigen::Matrix3d::Identity(), to_m});
  }
  static WorkspaceCommand remove(const std::string& object) {
    return make_command(WorkspaceOperation::kRemove, object);
  }

  std::optional<LiveCell> live_;
  std::uint64_t hash_ = 0;
};

TEST_F(Commands, MoveEndsInTheCellWhoseFileHasItThere) {
  const auto change = apply(move("ball", {0.1, -0.1, 0.2}));
  ASSERT_TRUE(change) << change.status().message();
  EXPECT_EQ(change->id, 1);
  EXPECT_EQ(change->workspace.version, 8U);
  EXPECT_THAT(change->message,
              AllOf(HasSubstr("moved 'ball' (object 1)"), HasSubstr("(0.100, -0.100, 0.200) m")));
  EXPECT_EQ(order_at(live_->workspace(), 0.101, -0.101, 0.201), workspace::kOrderInterior);
  EXPECT_EQ(live_->content_hash(), hash_of(cell_with("xyz_m: [0.0, 0.0, 0.3]", "xyz_m: [0.1, -0.1, 0.2]")));
  EXPECT_EQ(live_->objects().at(1).config.X_WO.translation_m, Eigen::Vector3d(0.1, -0.1, 0.2));
}

TEST_F(Commands, MoveMayGiveAGuardSkinThatLaterMovesKeep) {
  WorkspaceCommand command = move("ball", {0.1, -0.1, 0.2});
  command.guard_vox = 2;
  const std::size_t others =
      layers::count_orders(live_->workspace())[static_cast<std::uint8_t>(workspace::kOrderGuard)];
  const auto change = live_->apply(command, 8, {});
  ASSERT_TRUE(change) << change.status().message();
  EXPECT_THAT(change->message, HasSubstr("guard 2 voxels"));
  const auto guards = [&] {
    return layers::count_orders(live_->workspace())[static_cast<std::uint8_t>(workspace::kOrderGuard)];
  };
  const auto guarded = guards();
  EXPECT_GT(guarded, others);
  ASSERT_TRUE(live_->apply(move("ball", {0.1, -0.1, 0.2}), 9, {}));
  EXPECT_EQ(guards(), guarded);
  command.guard_vox = 0;
  ASSERT_TRUE(live_->apply(command, 10, {}));
  EXPECT_EQ(guards(), others);
}

TEST_F(Commands, AGuardThatAMoveGivesIsTheErrorOfThePose) {
  EXPECT_EQ(live_->objects().at(1).config.pose_error_m, 0.0) << "the cell file states none";
  WorkspaceCommand command = move("ball", {0.1, -0.1, 0.2});
  command.guard_vox = 2;
  ASSERT_TRUE(live_->apply(command, 8, {}));
  const double side_m = live_->workspace().grid().voxel_size_m.reference_m();
  EXPECT_DOUBLE_EQ(live_->objects().at(1).config.pose_error_m, 2 * side_m);
  EXPECT_DOUBLE_EQ(live_->objects().at(1).guard_m, 2 * side_m);
  ASSERT_TRUE(live_->apply(move("ball", {0.1, -0.1, 0.25}), 9, {}));
  EXPECT_DOUBLE_EQ(live_->objects().at(1).config.pose_error_m, 2 * side_m) << "nothing new is said of it";
  command.guard_vox = 0;
  ASSERT_TRUE(live_->apply(command, 10, {}));
  EXPECT_EQ(live_->objects().at(1).config.pose_error_m, 0.0);
}

TEST_F(Commands, AnObjectIsFoundByItsIdToo) {
  const auto change = live_->apply(
      make_command(WorkspaceOperation::kMove, "", 3, {Eigen::Matrix3d::Identity(), {0.2, 0.0, 0.15}}), 8, {});
  ASSERT_TRUE(change);
  EXPECT_EQ(change->name, "right post");
}

TEST_F(Commands, RemoveEndsInTheCellWhoseFileLacksIt) {
  ASSERT_TRUE(apply(remove("right post")));
  EXPECT_FALSE(live_->objects().contains(3));
  EXPECT_EQ(live_->objects().size(), 2U);
  EXPECT_EQ(order_at(live_->workspace(), 0.201, 0.101, 0.15), workspace::kOrderFree);
}

TEST_F(Commands, AddReadsAnObjectAsACellFileHasItAndGivesItAFreshId) {
  ASSERT_TRUE(live_->apply(remove("right post"), 8, {}));
  const auto change = live_->apply(
      add("{name: right post, mesh: post.stl, mesh_scale: 0.001, pose: {xyz_m: [0.2, -0.2, 0.15]}}"), 9, {});
  ASSERT_TRUE(change) << change.status().message();
  EXPECT_EQ(change->id, 4);  // ids that were given away stay so
  EXPECT_THAT(change->message, HasSubstr("added 'right post' (object 4)"));
  EXPECT_EQ(order_at(live_->workspace(), 0.201, -0.201, 0.15), workspace::kOrderInterior);
  EXPECT_EQ(live_->workspace().object(live_->workspace().grid().index_of({0.201, -0.201, 0.15})), 4);
  EXPECT_EQ(live_->objects().at(4).mesh_hash, live_->objects().at(2).mesh_hash);
}

TEST_F(Commands, AddTakesASolidByFormula) {
  const auto change =
      apply(add("{name: dome, primitive: {sphere: {radius_m: 0.06}}, pose: {xyz_m: [0.2, -0.2, 0.2]}}"));
  ASSERT_TRUE(change) << change.status().message();
  EXPECT_EQ(order_at(live_->workspace(), 0.201, -0.201, 0.201), workspace::kOrderInterior);
  const auto moved = live_->apply(move("dome", {-0.2, -0.2, 0.2}), 9, {});
  ASSERT_TRUE(moved);
  EXPECT_EQ(order_at(live_->workspace(), -0.201, -0.201, 0.201), workspace::kOrderInterior);
  EXPECT_EQ(order_at(live_->workspace(), 0.201, -0.201, 0.201), workspace::kOrderFree);
}

TEST_F(Commands, AddIsRefusedOnceTheVoxelsTakeTooMuchMemory) {
  const WorkspaceCommand dome =
      add("{name: dome, primitive: {sphere: {radius_m: 0.06}}, pose: {xyz_m: [0.2, -0.2, 0.2]}}");
  live_.emplace(activated(cell(), 7, {{}, 1 << 20}));  // each brick of an object takes 32 KiB
  EXPECT_THAT(refused(dome),
              AllOf(HasSubstr("of the 3 objects take"), HasSubstr("above 1 MiB (max_voxels_mib in")));
  ASSERT_TRUE(live_->apply(move("ball", {0.1, -0.1, 0.2}), 8, {}));
  ASSERT_TRUE(live_->apply(remove("left post"), 9, {}));
  live_.emplace(activated(cell(), 7, {{}, 1 << 30}));
  EXPECT_TRUE(live_->apply(dome, 8, {}));
}

// Tries wva_server: names an object that is not there
// Tries wva_server: one outside of the workspace … UTF-8
TEST_F(Commands, AreRefusedWithOneClearSentence) {
  EXPECT_THAT(refused(move("bell", {0, 0, 0.2})),
              AllOf(HasSubstr("no object 'bell' in cell desk"), HasSubstr("ball, left post, right post")));
  EXPECT_THAT(refused(make_command(WorkspaceOperation::kRemove, "", 9)), HasSubstr("no object 9"));
  EXPECT_THAT(refused(move("ball", {5, 0, 0.2})),
              AllOf(HasSubstr("'ball'"), HasSubstr("outside of the workspace")));
  EXPECT_THAT(refused(add("{name: [")), HasSubstr("YAML"));
  EXPECT_THAT(refused(add("name: box")), HasSubstr("mesh"));
  EXPECT_THAT(refused(add("{name: box, mesh: nowhere.stl}")), HasSubstr("nowhere.stl"));
  EXPECT_THAT(refused(add("{name: box, mesh: post.stl, mesh_scale: 0.001, spin: 3}")), HasSubstr("spin"));
  EXPECT_THAT(refused(add("{name: ball, mesh: post.stl, mesh_scale: 0.001}")), HasSubstr("is there already"));
  EXPECT_THAT(refused(add("{name: far, mesh: post.stl, mesh_scale: 0.001, pose: {xyz_m: [9, 0, 0]}}")),
              HasSubstr("outside of the workspace"));
  EXPECT_THAT(refused(add("{name: " + std::string(65, 'x') + ", mesh: post.stl}")), HasSubstr("65 bytes"));
  EXPECT_THAT(refused(add("{name: \"two\\nlines\", mesh: post.stl}")), HasSubstr("cannot be shown"));
  EXPECT_THAT(refused(add("{name: box\xff, mesh: post.stl}")), HasSubstr("allowed: UTF-8"));
  EXPECT_THAT(refused(add("{name: box, mesh: post.stl}  # caf\xe9")), HasSubstr("allowed: UTF-8"));
  EXPECT_THAT(refused(add("{name: keep out, kind: protected_zone, mesh: post.stl, mesh_scale: 0.001}")),
              HasSubstr("is for objects of the cell file"));
  write("garbage.stl", "this is no mesh");
  EXPECT_THAT(refused(add("{name: box, mesh: garbage.stl}")), HasSubstr("garbage.stl"));
}

TEST_F(Commands, MeshesOutsideOfTheCellsFolderAreNotRead) {
  std::filesystem::copy(folder_ / "post.stl", folder_.string() + "_elsewhere.stl");
  const std::string name = std::filesystem::path(folder_.string() + "_elsewhere.stl").filename();
  for (const std::string& path : {folder_.string() + "_elsewhere.stl", "../" + name}) {
    EXPECT_THAT(refused(add("{name: box, mesh_scale: 0.001, mesh: " + path + "}")),
                HasSubstr("not in the cell's folder"));
  }
  std::filesystem::create_symlink(folder_.string() + "_elsewhere.stl", folder_ / "link.stl");
  EXPECT_THAT(refused(add("{name: box, mesh_scale: 0.001, mesh: link.stl}")),
              HasSubstr("not in the cell's folder"));
  std::filesystem::remove(folder_.string() + "_elsewhere.stl");
}

// Tries wva_server: a command takes more work
TEST_F(Commands, WorkOfAFormulaIsCountedAndEndsAtTheLimit) {
  const std::string box = ", min_m: [-0.4, -0.4, 0.0], max_m: [0.4, 0.4, 0.5]}}";
  for (const std::string f :
       {"x*x - x*x + 1e-300", "sin(900*x)*sin(900*y)*sin(900*z)", "sin(1/x)*sin(1/y)"}) {
    AddLimits limits;
    limits.steps = 20'000'000;
    live_.emplace(activated(cell(), 7, limits));
    EXPECT_THAT(refused(add("{name: storm, implicit: {f: \"" + f + "\"" + box)),
                AnyOf(HasSubstr("takes more than 20 million steps; allowed"), HasSubstr("holds nothing")))
        << f;
  }
}

// Tries wva_server: a command takes more work
TEST_F(Commands, LayersAndMergingAreCountedAndEndAtTheLimit) {
  AddLimits limits;
  limits.steps = 60'000;  // voxelising the ball takes less, merging the bricks that it leaves and enters more
  live_.emplace(activated(cell(), 7, limits));
  const std::uint64_t before = live_->content_hash();
  EXPECT_THAT(refused(add("{name: whole, primitive: {sphere: {radius_m: 0.3}}, pose: {xyz_m: [0, 0, 0.3]}}")),
              HasSubstr("takes more than 0 million steps; allowed"));
  EXPECT_THAT(refused(move("ball", {0.1, -0.1, 0.2})),
              HasSubstr("merging its layers takes more than 0 million steps"));
  EXPECT_EQ(live_->content_hash(), before);
  EXPECT_TRUE(live_->apply(remove("ball"), 8, {})) << "what is there may be taken away";
}

TEST_F(Commands, ObjectsAreBoundedByTheirNumber) {
  AddLimits limits;
  limits.objects = 4;  // the cell has three
  live_.emplace(activated(cell(), 7, limits));
  const auto post = [](int number) {
    return add("{name: p" + std::to_string(number) + ", primitive: {sphere: {radius_m: 0.03}}}");
  };
  ASSERT_TRUE(live_->apply(post(1), 8, {}));
  const auto fifth = live_->apply(post(2), 9, {});
  ASSERT_FALSE(fifth);
  EXPECT_THAT(fifth.status().message(),
              AllOf(HasSubstr("there are 4 objects already; allowed: 4"), HasSubstr("commands.max_objects")));
  ASSERT_TRUE(live_->apply(remove("p1"), 9, {}));
  EXPECT_TRUE(live_->apply(post(2), 10, {}));
}

TEST_F(Commands, AFormulaOfTheUsualKindStaysFarBelowTheShippedLimit) {
  AddLimits limits;
  limits.steps = 500'000'000;  // half of it; its surface takes 324 million
  live_.emplace(activated(cell(), 7, limits));
  const auto change = live_->apply(
      add("{name: gyroid, implicit: {f: \"sin(60*x)*cos(60*y) + sin(60*y)*cos(60*z) + sin(60*z)*cos(60*x)\", "
          "min_m: [-0.1, -0.1, -0.1], max_m: [0.1, 0.1, 0.1]}, pose: {xyz_m: [0, 0, 0.2]}}"),
      8, {});
  EXPECT_TRUE(change) << change.status().message();
}

TEST_F(Commands, MeshesOverTheLimitAreRefusedByTheirTriangles) {
  AddLimits limits;
  limits.mesh.max_triangles = 1000;
  live_.emplace(activated(cell()));
  LiveCell live(runtime::load_cell(cell()), limits);
  const auto change = live.apply(add("{name: more, mesh: ball.stl, mesh_scale: 0.001}"), 8, {});
  ASSERT_FALSE(change);
  EXPECT_THAT(change.status().message(), HasSubstr("more than 1000 triangles"));
}

TEST_F(Commands, MeshesThatStayPublishedAreBounded) {
  AddLimits limits;
  limits.mesh_bytes = 40'000;
  live_.emplace(activated(cell(), 7, limits));
  std::string why;
  for (int i = 0; i < 50 && why.empty(); ++i) {
    const std::string radius = std::to_string(0.05 + 1e-4 * i), number = std::to_string(i);
    const auto version = 8 + 2 * static_cast<std::uint64_t>(i);
    const auto added = live_->apply(
        add("{name: b" + number + ", primitive: {sphere: {radius_m: " + radius + "}}}"), version, {});
    if (!added) {
      why = added.status().message();
    } else {
      ASSERT_TRUE(live_->apply(remove("b" + number), version + 1, {}));
    }
  }
  EXPECT_THAT(why, HasSubstr("stay published"));
}

class UnderWay : public Commands {
 protected:
  WorkspaceCommand storm() const {
    return add(
        "{name: storm, implicit: {f: \"x*x - x*x + 1e-300\", min_m: [-0.4, -0.4, 0], max_m: [0.4, 0.4, 0.5]}}");
  }
  static bool never() { return false; }
};

TEST_F(UnderWay, ARemoveOvertakesTheAddOfTheSameObjectOnly) {
  ChangeUnderWay change(*live_, storm(), 8, {}, never);
  EXPECT_EQ(change.doing(), "add 'storm'");
  EXPECT_TRUE(change.is_overtaken_by(remove("storm")));
  EXPECT_FALSE(change.is_overtaken_by(remove("ball")));
  EXPECT_FALSE(change.is_overtaken_by(move("storm", {0, 0, 0.2})));
  EXPECT_FALSE(change.is_overtaken_by(storm()));
  change.end();
  while (!change.wait(0.05)) {
  }
  EXPECT_FALSE(change.take());
}

TEST_F(UnderWay, EndsWithoutAChangeAndTheCellServesOn) {
  {
    ChangeUnderWay change(*live_, storm(), 8, {}, never);
    change.end();
  }  // its destructor waits
  EXPECT_EQ(live_->content_hash(), hash_);
  const WorkspaceCommand to_there = move("ball", {0.1, -0.1, 0.2});
  ChangeUnderWay next(*live_, to_there, 8, {}, never);
  EXPECT_TRUE(next.is_overtaken_by(make_command(WorkspaceOperation::kRemove, "", 1)));
  while (!next.wait(0.05)) {
  }
  EXPECT_TRUE(next.take());
}

}  // namespace
}  // namespace phantom::wva_server
