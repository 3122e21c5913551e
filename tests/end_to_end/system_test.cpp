// One run of the whole system, as the demo does it, with this test as one more participant on its topics.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <thread>
#include <vector>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/workspace/workspace_assembler.hpp"
#include "tests/end_to_end/running_system.hpp"

namespace phantom::end_to_end {
namespace {

constexpr double kSeconds = 25.0;

// Everything that came over DDS during the run.
struct Seen {
  std::mutex mutex;
  std::vector<msg::MasterState> masters;
  std::vector<msg::SlaveState> slaves;
  std::vector<msg::DragField> fields;
  std::vector<msg::Percept> percepts;
  std::vector<msg::HitAlert> hits;
  std::map<int, msg::WorkspaceObject> objects;
  std::map<std::uint64_t, std::set<std::uint32_t>> mesh_chunks;
  std::map<std::uint64_t, std::uint32_t> mesh_chunk_counts;
  std::map<std::string, msg::ComponentStatus> statuses;
  std::vector<msg::WorkspaceBrick> bricks;
  std::optional<msg::WorkspaceVersion> version;
};

class System : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    system_ = new RunningSystem(kSeconds);
    seen_ = new Seen;
    dds::Participant participant("system_test", system_->network());
    const auto keep = [](auto member) {
      return [member](const auto& sample, const dds::SampleInfo&) {
        const std::lock_guard lock(seen_->mutex);
        (seen_->*member).push_back(sample);
      };
    };
    const auto with = [](auto store) {
      return [store](const auto& sample, const dds::SampleInfo&) {
        const std::lock_guard lock(seen_->mutex);
        store(sample);
      };
    };
    dds::Reader<msg::MasterState> masters(participant, dds::kMasterState, keep(&Seen::masters));
    dds::Reader<msg::SlaveState> slaves(participant, dds::kSlaveState, keep(&Seen::slaves));
    dds::Reader<msg::DragField> fields(participant, dds::kDragField, keep(&Seen::fields));
    dds::Reader<msg::Percept> percepts(participant, dds::kPercept, keep(&Seen::percepts));
    dds::Reader<msg::HitAlert> hits(participant, dds::kHitAlert, keep(&Seen::hits));
    dds::Reader<msg::WorkspaceBrick> bricks(participant, dds::kWorkspaceBrick, keep(&Seen::bricks));
    dds::Reader<msg::WorkspaceVersion> version(
        participant, dds::kWorkspaceVersion,
        with([](const msg::WorkspaceVersion& v) { seen_->version = v; }));
    dds::Reader<msg::WorkspaceObject> objects(
        participant, dds::kWorkspaceObject,
        with([](const msg::WorkspaceObject& o) { seen_->objects[o.id()] = o; }));
    dds::Reader<msg::MeshChunk> meshes(participant, dds::kMeshChunk, with([](const msg::MeshChunk& c) {
                                         seen_->mesh_chunks[c.mesh_hash()].insert(c.chunk());
                                         seen_->mesh_chunk_counts[c.mesh_hash()] = c.chunk_count();
                                       }));
    dds::Reader<msg::ComponentStatus> statuses(
        participant, dds::kComponentStatus,
        with([](const msg::ComponentStatus& s) { seen_->statuses[s.component_name().to_string()] = s; }));
    exit_code_ = system_->wait();
    if (exit_code_ != 0) std::cerr << system_->output();
    const std::string text = read_text(system_->report() / "summary.json");
    summary_ = new nlohmann::json(nlohmann::json::parse(text, nullptr, false));
  }
  static void TearDownTestSuite() {
    delete summary_;
    delete seen_;
    delete system_;
  }

  static RunningSystem* system_;
  static Seen* seen_;
  static nlohmann::json* summary_;
  static int exit_code_;
};
RunningSystem* System::system_ = nullptr;
Seen* System::seen_ = nullptr;
nlohmann::json* System::summary_ = nullptr;
int System::exit_code_ = -1;

TEST_F(System, EndsInOrderWithAllSixComponents) {
  EXPECT_EQ(exit_code_, 0);
  for (const char* name :
       {"wva_server", "slave_io", "phantom_sensing", "master_io", "audio_percept", "synthetic_viewer"}) {
    ASSERT_TRUE(seen_->statuses.contains(name)) << name;
    EXPECT_EQ((*summary_)["components"][name]["exit"], 0) << name;
  }
}

TEST_F(System, TheWorkspaceArrivesWholeAndItsHashAgrees) {
  ASSERT_TRUE(seen_->version.has_value());
  const auto version = messages::from_idl(*seen_->version);
  ASSERT_TRUE(version) << version.status().message();
  workspace::WorkspaceAssembler assembler;
  for (const auto& message : seen_->bricks) {
    const auto brick = messages::from_idl(message);
    ASSERT_TRUE(brick) << brick.status().message();
    ASSERT_TRUE(assembler.put_brick(brick->key, brick->version, brick->voxels_zstd));
  }
  ASSERT_TRUE(assembler.commit(version->description));
  const auto workspace = assembler.current();
  ASSERT_NE(workspace, nullptr) << "count and hash must agree";
  EXPECT_GE(workspace->grid().extent_m().x(), 2.0);
  EXPECT_GE(seen_->objects.size(), 12u);
  std::set<std::uint16_t> ids;
  for (const auto& key : workspace->bricks()) {
    std::vector<std::uint16_t> objects(workspace::kBrickVoxels);
    workspace->brick(key).copy_objects(objects.data());
    ids.insert(objects.begin(), objects.end());
  }
  for (const auto& [id, object] : seen_->objects) {
    EXPECT_TRUE(ids.contains(static_cast<std::uint16_t>(id))) << object.name() << " left no voxel";
    EXPECT_EQ(seen_->mesh_chunks[object.mesh_hash()].size(), seen_->mesh_chunk_counts[object.mesh_hash()])
        << object.name();
  }
}

// A slave that follows is late by the lag of its position loops and of what its host slips; one that does not
// differs by as much as the master has moved.
TEST_F(System, TheSlaveFollowsTheMaster) {
  std::map<std::uint64_t, const msg::MasterState*> by_number;
  for (const auto& master : seen_->masters) by_number[master.stamp().sequence_number()] = &master;
  std::vector<double> apart;  // rad or m, of the joint that is farthest off, out of contact
  std::map<std::uint32_t, std::array<double, 2>> ranges;
  for (const auto& slave : seen_->slaves) {
    const auto master = by_number.find(slave.master_echo().sequence_number());
    if (slave.state() != msg::LinkState::LINK_COUPLED || slave.contact() || master == by_number.end())
      continue;
    apart.push_back(0.0);
    for (std::uint32_t j = 0; j < slave.joint_count(); ++j) {
      const double q = master->second->position_rad()[j];
      apart.back() = std::max(apart.back(), std::abs(slave.position_rad()[j] - q));
      auto& range = ranges.try_emplace(j, std::array{q, q}).first->second;
      range = {std::min(range[0], q), std::max(range[1], q)};
    }
  }
  ASSERT_GT(apart.size(), 1000U);
  std::sort(apart.begin(), apart.end());
  const auto share = [&](double part) {
    return apart[static_cast<std::size_t>(part * static_cast<double>(apart.size() - 1))];
  };
  double moved = 0.0;
  for (const auto& [joint, range] : ranges) moved = std::max(moved, range[1] - range[0]);
  EXPECT_GT(moved, 0.3) << "else nobody has followed anything";
  EXPECT_LT(share(0.5), 0.02);
  EXPECT_LT(share(0.9), 0.08) << "beside what is left of a contact when it ends";
}

TEST_F(System, DragComesFromTheSlavesPoseAndAWholeWorkspace) {
  int valid = 0;
  dds::SequenceGuard order;
  for (const auto& field : seen_->fields) {
    EXPECT_TRUE(order.accept(field.stamp()));
    if (!field.valid()) continue;
    ++valid;
    EXPECT_EQ(field.workspace_version(), seen_->version->version());
    for (std::uint32_t j = 0; j < field.joint_count(); ++j) {
      EXPECT_GE(field.coefficient_plus()[j], 0.0);
      EXPECT_GE(field.coefficient_minus()[j], 0.0);
    }
  }
  EXPECT_GT(valid, 1000);
}

TEST_F(System, ThePerceptDissuadesAndNeverPushes) {
  double greatest_power_W = -1e9, greatest_Nm = 0.0;
  for (const auto& master : seen_->masters) {
    double power_W = 0.0;
    for (std::uint32_t j = 0; j < master.joint_count(); ++j) {
      power_W += master.percept_torque_Nm()[j] * master.velocity_rad_s()[j];
      greatest_Nm = std::max(greatest_Nm, std::abs(master.percept_torque_Nm()[j]));
    }
    greatest_power_W = std::max(greatest_power_W, power_W);
  }
  EXPECT_GT(greatest_Nm, 0.1);
  EXPECT_LE(greatest_power_W, 1e-9) << "drag takes energy from the hand, always";
}

TEST_F(System, TorqueRisesBeforeContactAndOnlyWithThePercept) {
  int with = 0, without = 0;
  for (const auto& reach : (*summary_)["reaches"]) {
    if (reach["percept"].get<bool>()) {
      if (reach["contact_t"].is_null()) continue;
      ++with;
      EXPECT_FALSE(reach["onset_distance_m"].is_null()) << reach.dump();
      if (!reach["onset_distance_m"].is_null()) {
        EXPECT_GT(reach["onset_distance_m"].get<double>(), 0.005) << reach.dump();
      }
      EXPECT_GT(reach["peak_torque_nm"].get<double>(), 0.05) << reach.dump();
    } else {
      ++without;
      EXPECT_EQ(reach["peak_torque_nm"].get<double>(), 0.0);
    }
  }
  EXPECT_GE(with, 1);
  EXPECT_GE(without, 1);
}

TEST_F(System, AThreateningHitIsToldAndShown) {
  ASSERT_FALSE(seen_->hits.empty());
  const auto& hit = seen_->hits.front();
  EXPECT_TRUE(seen_->objects.contains(hit.object()));
  ASSERT_FALSE((*summary_)["hits"].empty());
  ASSERT_FALSE((*summary_)["views"].empty());
  const auto png = system_->report() / (*summary_)["views"][0]["png"].get<std::string>();
  EXPECT_EQ(read_text(png).substr(1, 3), "PNG");
}

TEST_F(System, ThePerceptIsHeard) {
  ASSERT_TRUE((*summary_)["audio"].is_string());
  const auto wav = read_text(system_->report() / (*summary_)["audio"].get<std::string>());
  EXPECT_EQ(wav.substr(0, 4), "RIFF");
  EXPECT_GT(wav.size(), 48000u * 2u * 5u) << "at least five seconds of sound";
}

/// Returns whether this user's threads may have a real-time priority, as the servos ask for.
bool real_time_priority_allowed() {
  bool allowed = false;
  std::thread([&] {
    const sched_param lowest{sched_get_priority_min(SCHED_FIFO)};
    allowed = pthread_setschedparam(pthread_self(), SCHED_FIFO, &lowest) == 0;
  }).join();
  return allowed;
}

// 1 kHz ± 2 %, or as even as an empty loop beside it: what the host lets no loop have, it cannot have.
TEST_F(System, TheServosRunAt1kHzOrAsEvenlyAsABareLoopOnThisHost) {
  if (!real_time_priority_allowed())
    GTEST_SKIP() << "real-time priorities are refused here: servos share the cores with the pictures";
  const auto& loops = (*summary_)["loops"];
  const auto slip_share = [&](const char* name) {
    const auto& loop = loops.at(name);
    const double ticks = loop.at("ticks"), slips = loop.at("slips");
    EXPECT_EQ(loop.at("nominal_hz"), 1000.0) << name;
    EXPECT_GE(ticks + slips, 1000.0 * (kSeconds - 2.0)) << name << ": told once a second";
    return slips / (ticks + slips);
  };
  const double bare = slip_share("master_io.bare_loop");
  for (const char* name : {"master_io.servo", "slave_io.servo"}) {
    const double share = slip_share(name);
    std::cout << name << ": " << 1000.0 * (1.0 - share) << " Hz, bare loop " << 1000.0 * (1.0 - bare)
              << " Hz\n";
    EXPECT_LE(share, 0.02 + 1.5 * bare) << name;
  }
}

TEST_F(System, RoundTripsAreMeasured) {
  ASSERT_TRUE((*summary_)["round_trip"].is_object());
  EXPECT_GT((*summary_)["round_trip"]["n"].get<std::uint64_t>(), 10000u);
  EXPECT_GT((*summary_)["round_trip"]["p50_us"].get<double>(), 0.0);
}

TEST_F(System, TheReportNamesTheRowOfTheTable) {
  ASSERT_FALSE((*summary_)["percept_sets"].empty());
  EXPECT_EQ((*summary_)["percept_sets"][0]["set"], "b1: SCTFB, balanced arm: drag, tone and views");
}

TEST_F(System, ThePlotsAreDrawn) {
  for (const char* name : {"torque_over_distance.png", "contact_speed.png", "session.png"}) {
    EXPECT_GT(read_text(system_->report() / name).size(), 5000u) << name;
  }
}

}  // namespace
}  // namespace phantom::end_to_end
