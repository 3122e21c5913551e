// A recording shown again: each of its moments is what a reader finds who reads all that came before.
#include "components/synthetic_viewer/review/review.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "common/core/errors.hpp"
#include "common/messages/living.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/synthetic_viewer/page/page_state.hpp"
#include "components/synthetic_viewer/review/tests/recorded_session.hpp"

namespace phantom::synthetic_viewer {
namespace {

using test::RecordingWriter;
using testing::HasSubstr;

class Reviewed : public testing::Test {
 protected:
  Reviewed() { std::filesystem::create_directories(folder_); }
  ~Reviewed() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path file(const std::string& name = "session.mcap") const { return folder_ / name; }
  void write_session(double seconds = 20, double rate_hz = 100, unsigned seed = 1) {
    RecordingWriter writer(file());
    test::write_session(writer, cell_.arm().home, arm_.links().size(), seconds, rate_hz, seed);
    writer.finish();
  }
  std::unique_ptr<Review> open(std::vector<std::filesystem::path> files = {}) {
    if (files.empty()) files = {file()};
    return std::make_unique<Review>(recording::open_recordings(files, Review::kLimits), arm_);
  }
  /// The state of a reader who has read the whole recording until `at_ns`, message by message.
  RecordedMoment literal(core::Nanoseconds at_ns) {
    const auto opened = recording::open_recordings({file()});
    RecordedMoment moment({.joint_count = arm_.joint_count(), .link_count = arm_.links().size()});
    RecordedTopics topics;
    recording::MessageCursor cursor(opened[0].reader);
    for (recording::Message message; cursor.next(message);) {
      if (message.log_time_ns > static_cast<std::uint64_t>(at_ns)) break;
      topics.take(topics.source_of(opened[0].reader.channels().at(message.channel_id)), message, moment);
    }
    moment.state.stops = moment.stops.at(at_ns);
    return moment;
  }
  /// Everything that a state says, in words.
  std::string words(const ViewerState& state, core::Nanoseconds at_ns) const {
    const PageFacts facts{"cell", true, true, 0.0, "none", RecordingWriter::kBegin_ns, {}, {}};
    std::string text = page_state(state, scene_, {}, {}, facts, at_ns).dump() + stop_json(state.stops);
    for (const double position : state.arm.position) text += " " + std::to_string(position);
    text += "\nbanner " + banner_text(state, {}, at_ns) + "\nskin";
    for (const SkinPatchSample& patch : state.skin.felt)
      text += " " + std::to_string(patch.link) + ":" + std::to_string(patch.closeness);
    for (const HitRecord& record : state.hits)
      text += "\nhit " + std::to_string(record.raised.arm.received_ns) + " " +
              std::to_string(record.raised.percept.received_ns) + " " +
              std::to_string(record.raised.received_ns);
    for (const auto& [id, object] : state.objects)
      text += "\nobject " + object.name + " " + std::to_string(object.X_WO.translation_m.x());
    text += "\narm " + std::to_string(state.arm.received_ns) + " " + std::to_string(state.arm.arrived) + " " +
            std::to_string(state.arm.lost) + " share " + std::to_string(state.link_quality.share());
    return text + "\nmaster " + std::to_string(state.master.received_ns) + " percept " +
           std::to_string(state.percept.received_ns) + " first object " +
           std::to_string(state.first_object_ns);
  }
  /// What the review shows at a time.
  ViewerState shown(Review& review, core::Nanoseconds at_ns) {
    EXPECT_TRUE(review.control({.t_s = core::seconds(at_ns - review.begin_ns())}, now_ns_));
    ViewerState state;
    const Review::Shown shown = review.advance(now_ns_, state);
    EXPECT_LE(std::abs(shown.at_ns - at_ns), 1000);
    now_ns_ += core::kNsPerSecond;
    at_ns_ = shown.at_ns;
    return state;
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("review_" + std::to_string(getpid()));
  const runtime::CellConfig cell_ =
      runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/two_plates/cell.yaml");
  const robot::SerialArm arm_ = runtime::load_arm(cell_.arm());
  const CellScene scene_{arm_, cell_.min_m, cell_.max_m};
  core::Nanoseconds now_ns_ = core::kNsPerSecond;
  core::Nanoseconds at_ns_ = 0;  ///< the log time that was shown last
};

TEST_F(Reviewed, EveryMomentIsWhatAReaderOfAllBeforeItFinds) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    write_session(20, 100, seed);
    const auto review = open();
    ASSERT_GT(review->moments(), 10U);
    std::vector<core::Nanoseconds> times;
    std::mt19937 random(seed);
    for (int i = 0; i < 25; ++i)
      times.push_back(
          std::uniform_int_distribution<core::Nanoseconds>(review->begin_ns(), review->end_ns())(random));
    const auto opened = recording::open_recordings({file()});
    const auto& blocks = opened[0].reader.blocks();
    ASSERT_GT(blocks.size(), 20U);
    for (std::size_t i = 1; i + 1 < blocks.size(); i += 1 + blocks.size() / 8) {  // at the borders of chunks
      times.push_back(static_cast<core::Nanoseconds>(blocks[i].start_ns));
      times.push_back(static_cast<core::Nanoseconds>(blocks[i].end_ns) - 1);
    }
    std::shuffle(times.begin(), times.end(), random);
    times.push_back(review->begin_ns());
    times.push_back(review->end_ns());
    for (const core::Nanoseconds at_ns : times) {
      const ViewerState state = shown(*review, at_ns);
      EXPECT_EQ(words(state, at_ns_), words(literal(at_ns_).state, at_ns_))
          << "seed " << seed << " at " << core::seconds(at_ns - review->begin_ns()) << " s";
    }
  }
}

TEST_F(Reviewed, WhatCamerasFoundAndSawIsShownAsItWasThen) {
  write_session();
  const auto review = open();
  const auto at = [&](double share) {
    return shown(*review, review->begin_ns() +
                              static_cast<core::Nanoseconds>(
                                  share * static_cast<double>(review->end_ns() - review->begin_ns())));
  };
  EXPECT_TRUE(at(0.1).live.empty());
  EXPECT_EQ(at(0.25).live.at(messages::kFirstLiveObjectId).name, "bucket");
  ASSERT_EQ(at(0.25).displaced().size(), 1U);
  EXPECT_EQ(at(0.58).live.at(messages::kFirstLiveObjectId).standing, messages::LiveStanding::kFrozen);
  EXPECT_TRUE(at(0.65).displaced().empty());
  EXPECT_TRUE(at(0.9).live.empty());
  EXPECT_EQ(at(0.25).displaced().size(), 1U) << "back again";
}

TEST_F(Reviewed, PlayingOnFindsTheSameAsGoingThere) {
  write_session();
  const auto review = open();
  ASSERT_TRUE(review->control({.t_s = 0.0, .play = true, .rate = 2.0}, now_ns_));
  ViewerState state;
  std::size_t hits = 0;
  for (int i = 0; i < 60; ++i) {
    const Review::Shown shown = review->advance(now_ns_, state);
    EXPECT_EQ(shown.jumped, i == 0);
    hits += shown.hits.size();
    if (i % 10 == 0) {
      EXPECT_EQ(shown.at_ns, review->begin_ns() + i * core::kNsPerSecond / 5);
      EXPECT_EQ(words(state, shown.at_ns), words(literal(shown.at_ns).state, shown.at_ns));
    }
    now_ns_ += core::kNsPerSecond / 10;
  }
  std::size_t marks = 0;
  const core::Nanoseconds end_ns = review->begin_ns() + 59 * core::kNsPerSecond / 5;
  for (const AlertMark& mark : review->marks())
    marks +=
        (mark.raised_ns <= end_ns ? 1U : 0U) + (mark.cleared_ns != 0 && mark.cleared_ns <= end_ns ? 1U : 0U);
  EXPECT_GT(hits, 5U);
  EXPECT_EQ(hits, marks);
}

TEST_F(Reviewed, MarksAreTheAlertsOfTheRecording) {
  write_session();
  std::vector<AlertMark> expected;
  const auto opened = recording::open_recordings({file()});
  recording::MessageCursor cursor(opened[0].reader);
  for (recording::Message message; cursor.next(message);) {
    if (opened[0].reader.channels().at(message.channel_id).topic != "hit_alert") continue;
    msg::HitAlert alert;
    ASSERT_TRUE(dds::decode(dds::kHitAlert, message.data, alert));
    const auto at_ns = static_cast<core::Nanoseconds>(message.log_time_ns);
    if (alert.cleared())
      expected.back().cleared_ns = at_ns;
    else
      expected.push_back({at_ns, 0, alert.alert(), HitRule::kVeryClose, "arm", "upright", "", 0.0});
  }
  const auto review = open();
  ASSERT_GT(expected.size(), 10U);
  EXPECT_EQ(review->marks(), expected);
  // An alert is there from its mark on.
  for (std::size_t i = 0; i < expected.size(); i += 5) {
    EXPECT_EQ(shown(*review, expected[i].raised_ns + 1000).hits.back().raised.alert, expected[i].alert);
    EXPECT_EQ(shown(*review, expected[i].raised_ns - 2000).total_hits, i);
  }
}

TEST_F(Reviewed, SeriesAreTheNumbersOfTheRecording) {
  write_session();
  const auto review = open();
  float least = 9, greatest = -9;
  const auto opened = recording::open_recordings({file()});
  recording::MessageCursor cursor(opened[0].reader);
  for (recording::Message message; cursor.next(message);) {
    if (opened[0].reader.channels().at(message.channel_id).topic != "master_state") continue;
    msg::MasterState master;
    ASSERT_TRUE(dds::decode(dds::kMasterState, message.data, master));
    least = std::min(least, static_cast<float>(master.percept_torque_Nm()[1]));
    greatest = std::max(greatest, static_cast<float>(master.percept_torque_Nm()[1]));
  }
  const auto series = std::ranges::find(review->series(), "percept/1", &ReviewSeries::name);
  ASSERT_NE(series, review->series().end());
  EXPECT_EQ(series->label, arm_.joints()[1].name);
  EXPECT_EQ(series->values.columns(review->begin_ns(), review->end_ns() + 1, 1)[0],
            (ReducedSeries::Span{least, greatest}));
  EXPECT_EQ(review->series().size(), 5 + 2 * arm_.joint_count());
  // Nothing was sent in the gap.
  const auto slave = std::ranges::find(review->series(), "slave", &ReviewSeries::name);
  EXPECT_EQ(
      slave->values.columns(review->begin_ns() + 14'100'000'000, review->begin_ns() + 14'500'000'000, 1)[0],
      ReducedSeries::Span());
}

TEST_F(Reviewed, KeepsFewMomentsOfALongRecording) {
  write_session(3 * 3600.0, 1.0);
  const auto review = open();
  EXPECT_LE(review->moments(), Review::kMaxMoments);
  EXPECT_GT(review->moments(), Review::kMaxMoments / 3);
  EXPECT_LE(review->moment_bytes(), Review::kMaxMomentBytes);
  for (const double share : {0.9, 0.1, 0.55}) {
    const auto at_ns = review->begin_ns() + core::from_seconds(share * review->duration_s());
    const ViewerState state = shown(*review, at_ns);
    EXPECT_EQ(words(state, at_ns_), words(literal(at_ns_).state, at_ns_));
  }
}

TEST_F(Reviewed, FilesOfASeriesAreOneRecording) {
  write_session();
  const auto whole = recording::open_recordings({file()});
  const auto middle_ns = whole[0].reader.statistics().message_start_time_ns + 9'000'000'000;
  {
    RecordingWriter first(file("a.mcap")), second(file("b.mcap"));
    recording::MessageCursor cursor(whole[0].reader);
    for (recording::Message message; cursor.next(message);) {
      const auto& channel = whole[0].reader.channels().at(message.channel_id);
      const auto process = static_cast<unsigned>(std::stoi(channel.metadata.at("writer").substr(0, 2)));
      const recording::Bytes bytes(message.data.begin(), message.data.end());
      // Here and there a sample is in the next file though its neighbours are in this one.
      const bool later = message.log_time_ns >= middle_ns ||
                         (message.log_time_ns > middle_ns - 50'000'000 && bytes.size() % 3 == 0);
      (later ? second : first).put_at(channel.topic, bytes, message.log_time_ns, process);
      if (channel.topic == "workspace_object")
        second.put_at(channel.topic, bytes, middle_ns, process, true);  // carried over: it came before
    }
    first.finish();
    second.finish();
  }
  const auto review = open({file("b.mcap"), file("a.mcap")});
  for (const double t_s : {8.97, 3.0, 12.0, 9.0, 19.0}) {
    const ViewerState state = shown(*review, review->begin_ns() + core::from_seconds(t_s));
    EXPECT_EQ(words(state, at_ns_), words(literal(at_ns_).state, at_ns_)) << t_s;
  }
}

TEST_F(Reviewed, WhoTurnsAViewDoesSoUntilHeLetsGo) {
  {
    RecordingWriter writer(file());
    test::write_session(writer, cell_.arm().home, arm_.links().size(), 2, 50, 1);
    messages::OperatorCommand command;
    command.kind = CommandKind::kViewNode;
    command.value = 3;
    writer.put(dds::kOperatorCommand, messages::to_idl(command), 1.99);
    writer.finish();
  }
  const auto review = open();
  const auto chosen = [&] { return static_cast<int>(shown(*review, review->end_ns()).chosen); };
  EXPECT_EQ(chosen(), 3);  // as it was then
  Command command;
  command.kind = CommandKind::kViewNode;
  command.value = 9;
  review->choose(command);
  EXPECT_EQ(chosen(), 9);
  command.value = 0;
  review->choose(command);
  EXPECT_EQ(chosen(), 3);
  command.kind = CommandKind::kViewHold;
  command.value = 1;
  review->choose(command);
  EXPECT_TRUE(shown(*review, review->begin_ns()).hold);
}

TEST_F(Reviewed, GoesWhereItMayAndStopsAtTheEnd) {
  write_session(5);
  const auto review = open();
  const double end_s = review->duration_s();
  for (const double wrong : {-0.1, end_s + 0.1, std::nan("")})
    EXPECT_THAT(review->control({.t_s = wrong}, now_ns_).message(),
                HasSubstr("t must be a number from 0 to"));
  for (const double wrong : {0.0, 0.09, 10.1, -1.0})
    EXPECT_THAT(review->control({.rate = wrong}, now_ns_).message(),
                HasSubstr("rate must be a number from 0.1 to 10"));
  ViewerState state;
  ASSERT_TRUE(review->control({.t_s = end_s - 0.5, .play = true, .rate = 1.0}, now_ns_));
  EXPECT_TRUE(review->position(now_ns_).playing);
  now_ns_ += core::kNsPerSecond;
  EXPECT_EQ(review->advance(now_ns_, state).at_ns, review->end_ns());
  EXPECT_FALSE(review->position(now_ns_).playing);
  ASSERT_TRUE(review->control({.play = true}, now_ns_));  // again from the beginning
  EXPECT_EQ(review->advance(now_ns_, state).at_ns, review->begin_ns());
  now_ns_ += core::kNsPerSecond / 4;
  ASSERT_TRUE(review->control({.play = false}, now_ns_));
  now_ns_ += core::kNsPerSecond;
  EXPECT_EQ(review->advance(now_ns_, state).at_ns, review->begin_ns() + core::kNsPerSecond / 4);
}

// Tries synthetic_viewer: a recording that is cut off
TEST_F(Reviewed, WhatIsCutOffIsReadAsFarAsItIsWhole) {
  write_session();
  std::filesystem::copy_file(file(), file("whole.mcap"));
  for (const double share : {0.3, 0.77}) {
    const auto size = static_cast<std::uintmax_t>(
        share * static_cast<double>(std::filesystem::file_size(file("whole.mcap"))));
    std::filesystem::copy_file(file("whole.mcap"), file(), std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(file(), size);
    const auto review = open();
    EXPECT_NEAR(review->duration_s(), share * 20, 3);
    EXPECT_THAT(review->problems(), testing::Contains(HasSubstr("it ends in the middle of a record")));
    const ViewerState state = shown(*review, review->end_ns());
    EXPECT_EQ(words(state, at_ns_), words(literal(at_ns_).state, at_ns_));
  }
}

// Tries synthetic_viewer: a file that is no recording
// Tries synthetic_viewer: in which nothing fits the cell's arm
TEST_F(Reviewed, WhatIsNoRecordingIsRefusedInOneSentence) {
  const auto refusal = [this] {
    try {
      open();
    } catch (const core::ConfigError& problem) {
      return std::string(problem.what());
    }
    return std::string("none");
  };
  std::ofstream(file()) << "no recording";
  EXPECT_THAT(refusal(), HasSubstr("is not an MCAP file"));
  { RecordingWriter(file("empty.mcap")).finish(); }
  std::filesystem::rename(file("empty.mcap"), file());
  EXPECT_THAT(refusal(), HasSubstr("nothing to show"));
  {
    RecordingWriter writer(file("other.mcap"));
    messages::SlaveState other;
    other.joint_count = static_cast<std::uint32_t>(arm_.joint_count() + 1);
    for (int i = 0; i < 50; ++i) writer.put(dds::kSlaveState, messages::to_idl(other), 0.01 * i);
    writer.finish();
  }
  std::filesystem::rename(file("other.mcap"), file());
  EXPECT_THAT(refusal(), HasSubstr("nothing to show"));
}

// Tries synthetic_viewer: a chunk of a recording is damaged
TEST_F(Reviewed, ADamagedChunkTakesOnlyItsOwnSamplesAlong) {
  write_session();
  std::uint64_t place = 0;
  {
    const auto opened = recording::open_recordings({file()});
    const auto& block = opened[0].reader.blocks()[opened[0].reader.blocks().size() / 2];
    place = block.offset + block.length / 2;
  }
  std::fstream stream(file(), std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(static_cast<std::streamoff>(place)).write("damage!!", 8);
  stream.close();
  const auto review = open();
  EXPECT_NEAR(review->duration_s(), 20, 0.1);
  ASSERT_EQ(review->problems().size(), 2U)
      << testing::PrintToString(review->problems());  // and what is not heeded
  EXPECT_THAT(review->problems()[0], HasSubstr("session.mcap: byte "));
  for (const double share : {0.9, 0.5, 0.52}) {
    const ViewerState state =
        shown(*review, review->begin_ns() + core::from_seconds(share * review->duration_s()));
    EXPECT_EQ(words(state, at_ns_), words(literal(at_ns_).state, at_ns_));
  }
}

TEST_F(Reviewed, NothingOfADamagedFileIsTrusted) {
  write_session(4);
  std::ifstream stream(file(), std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(stream)), {});
  for (unsigned seed = 0; seed < 60; ++seed) {
    std::mt19937 random(seed);
    std::string damaged = whole;
    for (int k = 0; k < 1 + static_cast<int>(seed % 40); ++k)
      damaged[random() % damaged.size()] = static_cast<char>(random());
    std::ofstream(file(), std::ios::binary) << damaged;
    try {
      const auto review = open();
      ViewerState state;
      for (const double share : {0.2, 0.9, 0.5}) {
        (void)review->control({.t_s = share * review->duration_s()}, now_ns_);
        review->advance(now_ns_, state);
        EXPECT_LE(state.hits.size(), ViewerState::kMaxHits);
      }
    } catch (const core::ConfigError&) {
    }
  }
}

TEST_F(Reviewed, TimesFromTheEndsOfTheWorldDoNoHarm) {
  {
    RecordingWriter writer(file());
    test::write_session(writer, cell_.arm().home, arm_.links().size(), 2, 50, 1);
    messages::SlaveState state;
    state.joint_count = static_cast<std::uint32_t>(arm_.joint_count());
    for (const std::uint64_t at_ns : {std::uint64_t{0}, std::uint64_t{1}, ~std::uint64_t{0},
                                      std::uint64_t{1} << 63U, std::uint64_t{1} << 62U}) {
      auto message = messages::to_idl(state);
      message.stamp().sequence_number(1'000'000 + at_ns % 7);
      message.stamp().session(77);
      recording::Bytes bytes;
      ASSERT_TRUE(dds::CdrCodec(dds::kSlaveState).encode(&message, bytes));
      writer.put_at("slave_state", bytes, at_ns, 3);
    }
    writer.finish();
  }
  const auto review = open();
  ViewerState state;
  for (const double share : {1.0, 0.0, 0.37}) {
    EXPECT_TRUE(review->control({.t_s = share * review->duration_s()}, now_ns_));
    review->advance(now_ns_, state);
  }
  EXPECT_LE(review->moments(), Review::kMaxMoments);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
