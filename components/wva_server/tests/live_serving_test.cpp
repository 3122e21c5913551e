#include "components/wva_server/live/live_serving.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/publisher.hpp"
#include "components/wva_server/tests/test_cell.hpp"

namespace phantom::wva_server::live_serving_test {
namespace {

using testing::HasSubstr;
using testing::Not;

/// A process that publishes what depth cameras see.
struct Source {
  Source(const core::NetworkOptions& network, const LiveCell& cell, const std::string& name)
      : participant(name, network), change() {
    change.source = name;
    change.cell = cell.cell().name;
    change.grid = cell.workspace().grid();
    change.whole = true;
    change.image_age_s = 0.05;
    change.cameras = {{"above", messages::DepthCameraState::kLive, 0.05, 15.0}};
  }
  /// A cube of 8 voxels at a block.
  void send(std::uint16_t x) {
    change.blocks = {{x, 1, 4, {}}};
    change.blocks[0].bits.fill(~std::uint64_t{0});
    publisher.publish(change);
  }
  dds::Participant participant;
  messages::Publisher<messages::OccupancyChange> publisher{participant, dds::kOccupancyChange};
  messages::OccupancyChange change;
};

class Serving : public TestCell {
 protected:
  LiveRules rules(OnLoss on_loss = OnLoss::kKeep) const {
    LiveRules rules;
    rules.source = "workspace_camera";
    rules.tolerance_vox = 1;
    rules.profile = {{2, 3}, {30.0F, 15.0F}, 100.0F, 0};
    rules.on_loss = on_loss;
    rules.silence_s = 0.3;
    return rules;
  }
  void begin(OnLoss on_loss = OnLoss::kKeep) {
    cell_.emplace(activated(cell(), 7));
    adapter_.emplace(network_, "");
    live_.emplace(rules(on_loss), *cell_, *adapter_, 1);
    live_->begin(8);
  }
  void step() {
    const core::Nanoseconds now_ns = core::monotonic_ns();
    if (live_->is_due(now_ns)) live_->step(now_ns, cell_->workspace().version + 1);
  }
  bool has_matter_at(std::uint16_t block) const {
    const workspace::Index3 middle{8 * block + 4, 12, 36};
    return messages::is_live(cell_->workspace().object(middle)) &&
           cell_->workspace().order(middle) == workspace::kOrderBoundary;
  }
  core::Health told() const {
    return live_->told({core::ComponentState::kRunning, "", {}, {}}, core::monotonic_ns());
  }

  core::NetworkOptions network_ = dds::test_network();
  std::optional<LiveCell> cell_;
  std::optional<DdsAdapter> adapter_;
  std::optional<LiveServing> live_;
};

TEST_F(Serving, WhatASourceSeesIsPublishedAsAVersionAndNamed) {
  begin();
  dds::Participant other("consumer", network_);
  dds::Waiter waiter;
  std::uint64_t version = 0;
  std::map<int, bool> objects;
  dds::Reader<msg::WorkspaceVersion> versions(
      other, dds::kWorkspaceVersion, [&](const msg::WorkspaceVersion& sample, const dds::SampleInfo&) {
        waiter.change([&] { version = sample.version(); });
      });
  dds::Reader<msg::WorkspaceObject> named(
      other, dds::kWorkspaceObject, [&](const msg::WorkspaceObject& sample, const dds::SampleInfo&) {
        waiter.change([&] { objects[sample.id()] = sample.mesh_hash() != 0; });
      });
  Source source(network_, *cell_, "workspace_camera");
  EXPECT_TRUE(dds::eventually([&] {
    source.send(4);
    step();
    return has_matter_at(4);
  }));
  EXPECT_TRUE(waiter.wait([&] { return version == cell_->workspace().version; }));
  EXPECT_TRUE(waiter.wait([&] { return objects[messages::kFirstLiveObjectId]; }));
  EXPECT_GT(live_->figures().latency_ms.back(), 50.0F) << "the image was 50 ms old when it was sent";
  EXPECT_TRUE(dds::eventually([&] {
    source.change.blocks.clear();
    source.publisher.publish(source.change);
    step();
    return !has_matter_at(4);
  }));
  EXPECT_TRUE(waiter.wait([&] { return !objects[messages::kFirstLiveObjectId]; }));
  EXPECT_EQ(told().state, core::ComponentState::kRunning);
}

// Tries wva_server: a second source of live matter sends
TEST_F(Serving, OfTwoSourcesTheFirstCountsAndTheSecondIsTold) {
  begin();
  Source first(network_, *cell_, "workspace_camera");
  ASSERT_TRUE(dds::eventually([&] {
    first.send(4);
    step();
    return has_matter_at(4);
  }));
  Source second(network_, *cell_, "workspace_camera");
  EXPECT_TRUE(dds::eventually([&] {
    first.send(4);
    second.send(6);
    step();
    EXPECT_FALSE(has_matter_at(6));
    return told().state == core::ComponentState::kDegraded &&
           told().message.find("occupancy_change") != std::string::npos;
  }));
}

// Tries wva_server: occupancy_change comes from a process, cell or grid that is not configured
TEST_F(Serving, OtherProcessesCellsAndGridsAreRefused) {
  begin();
  Source stranger(network_, *cell_, "somebody"), other_grid(network_, *cell_, "workspace_camera"),
      other_cell(network_, *cell_, "workspace_camera"), source(network_, *cell_, "workspace_camera");
  other_grid.change.grid.size_vox[0] += 1;
  other_cell.change.cell = "kitchen";
  EXPECT_TRUE(dds::eventually([&] {
    stranger.send(2);
    other_grid.send(3);
    other_cell.send(5);
    source.send(4);
    step();
    EXPECT_FALSE(has_matter_at(2) || has_matter_at(3) || has_matter_at(5));
    return has_matter_at(4);
  }));
}

// Tries wva_server: the source of live matter is silent
TEST_F(Serving, ASilentSourcesMatterIsKeptAndTold) {
  begin();
  {
    Source source(network_, *cell_, "workspace_camera");
    ASSERT_TRUE(dds::eventually([&] {
      source.send(4);
      step();
      return has_matter_at(4);
    }));
  }
  EXPECT_TRUE(dds::eventually([&] {
    step();
    return told().message.find("nothing is heard of workspace_camera") != std::string::npos;
  }));
  EXPECT_EQ(told().state, core::ComponentState::kDegraded);
  EXPECT_THAT(told().message, HasSubstr("is kept as it was"));
  EXPECT_TRUE(has_matter_at(4));
}

TEST_F(Serving, OrEndsByConfigurationAndBeginsAgain) {
  begin(OnLoss::kEnd);
  std::optional<Source> source;
  source.emplace(network_, *cell_, "workspace_camera");
  ASSERT_TRUE(dds::eventually([&] {
    source->send(4);
    step();
    return has_matter_at(4);
  }));
  const std::uint64_t version = cell_->workspace().version;
  source.reset();
  EXPECT_TRUE(dds::eventually([&] {
    step();
    return !has_matter_at(4);
  }));
  EXPECT_GT(cell_->workspace().version, version);
  EXPECT_THAT(told().message, HasSubstr("has ended"));
  source.emplace(network_, *cell_, "workspace_camera");
  EXPECT_TRUE(dds::eventually([&] {
    source->send(5);
    step();
    return has_matter_at(5);
  }));
  EXPECT_THAT(told().message, Not(HasSubstr("has ended")));
}

TEST_F(Serving, WhatAPersonDecidesIsCarriedOutAndTold) {
  begin();
  dds::Participant other("page", network_);
  dds::Waiter waiter;
  std::map<int, messages::LiveObject> things;
  dds::Reader<msg::LiveObject> told_things(other, dds::kLiveObject,
                                           [&](const msg::LiveObject& sample, const dds::SampleInfo&) {
                                             const auto thing = messages::from_idl(sample);
                                             if (thing) waiter.change([&] { things[thing->id] = *thing; });
                                             return thing.has_value();
                                           });
  Source source(network_, *cell_, "workspace_camera");
  ASSERT_TRUE(dds::eventually([&] {
    source.send(4);
    step();
    return has_matter_at(4);
  }));
  const auto decide = [&](WorkspaceOperation operation, const std::string& object,
                          const std::string& name = "") {
    WorkspaceCommand command = make_command(operation, object);
    command.description = name;
    const auto id = live_->subject(command);
    if (!id) return std::string("of the model");
    const auto decided = live_->decide(command, *id, core::monotonic_ns());
    step();
    return decided ? *decided : decided.status().message();
  };
  const auto is_told = [&](messages::LiveStanding standing, const std::string& name) {
    return waiter.wait([&] {
      const messages::LiveObject& thing = things[messages::kFirstLiveObjectId];
      return thing.standing == standing && thing.name == name;
    });
  };
  EXPECT_TRUE(is_told(messages::LiveStanding::kTracked, "live object 1"));
  EXPECT_EQ(decide(WorkspaceOperation::kFreeze, "ball"), "of the model");
  EXPECT_THAT(decide(WorkspaceOperation::kName, "live object 1", "ball"),
              HasSubstr("of the model is called 'ball'"));
  EXPECT_EQ(decide(WorkspaceOperation::kName, "live object 1", "bucket"),
            "'live object 1' is called 'bucket' now");
  EXPECT_TRUE(is_told(messages::LiveStanding::kTracked, "bucket"));
  EXPECT_THAT(decide(WorkspaceOperation::kMove, "bucket"),
              HasSubstr("allowed: name, freeze, discard, restore"));
  EXPECT_THAT(decide(WorkspaceOperation::kFreeze, "live object 1"), HasSubstr("cameras see no"))
      << "it is called otherwise";
  EXPECT_THAT(decide(WorkspaceOperation::kFreeze, "bucket"), HasSubstr("'bucket' stays as it is"));
  EXPECT_TRUE(is_told(messages::LiveStanding::kFrozen, "bucket"));
  EXPECT_THAT(told().message, HasSubstr("'bucket' is frozen"));
  source.change.blocks.clear();
  for (int i = 0; i < 5; ++i) {
    source.publisher.publish(source.change);
    step();
    EXPECT_TRUE(has_matter_at(4));
  }
  EXPECT_THAT(decide(WorkspaceOperation::kDiscard, "bucket"), HasSubstr("is not felt any more"));
  EXPECT_FALSE(has_matter_at(4));
  EXPECT_TRUE(is_told(messages::LiveStanding::kDiscarded, "bucket"));
  EXPECT_THAT(decide(WorkspaceOperation::kRestore, "bucket"), HasSubstr("is what cameras see of it again"));
  EXPECT_TRUE(dds::eventually([&] {
    source.send(4);
    step();
    return has_matter_at(4);
  }));
  EXPECT_TRUE(is_told(messages::LiveStanding::kTracked, "bucket"));
}

// Tries wva_server: a thing was frozen, and the server that froze it was killed
TEST_F(Serving, ASuccessorEndsWhatItsPredecessorToldOfThings) {
  dds::Participant page("page", network_);
  dds::Waiter waiter;
  messages::LiveStanding standing = messages::LiveStanding::kLost;
  dds::Reader<msg::LiveObject> things(page, dds::kLiveObject,
                                      [&](const msg::LiveObject& sample, const dds::SampleInfo&) {
                                        const auto thing = messages::from_idl(sample);
                                        if (thing && thing->id == messages::kFirstLiveObjectId)
                                          waiter.change([&] { standing = thing->standing; });
                                        return thing.has_value();
                                      });
  {
    dds::Participant killed("wva_server", network_);
    dds::Writer<msg::LiveObject> told(killed, dds::kLiveObject);
    told.write(messages::to_idl(
        messages::LiveObject{messages::kFirstLiveObjectId, messages::LiveStanding::kFrozen, "bucket"}));
    ASSERT_TRUE(waiter.wait([&] { return standing == messages::LiveStanding::kFrozen; }));
  }
  begin();
  EXPECT_TRUE(waiter.wait([&] { return standing == messages::LiveStanding::kLost; }));
}

TEST_F(Serving, ACameraThatIsDeadIsTold) {
  begin();
  Source source(network_, *cell_, "workspace_camera");
  source.change.cameras[0].state = messages::DepthCameraState::kDead;
  EXPECT_TRUE(dds::eventually([&] {
    source.send(4);
    step();
    return told().message.find("camera 'above' is dead") != std::string::npos;
  }));
  EXPECT_EQ(told().state, core::ComponentState::kDegraded);
}

}  // namespace
}  // namespace phantom::wva_server::live_serving_test
