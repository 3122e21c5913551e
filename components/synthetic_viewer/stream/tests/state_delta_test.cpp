#include "components/synthetic_viewer/stream/state_delta.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "components/synthetic_viewer/stream/tests/scene_decoder.hpp"

namespace phantom::synthetic_viewer {
namespace {

using Json = nlohmann::json;

/// One who is told at a pace of its own.
struct Reader {
  void catch_up(const StateDelta& board) {
    last = board.since(seen);
    if (!last.empty()) known.take_text(last);
  }
  std::uint64_t seen = 0;
  std::string last;
  test::DecodedScene known;
};

TEST(StateDelta, TellsAllAtFirstAndThenWhatHasChanged) {
  StateDelta board;
  Reader reader;
  reader.catch_up(board);
  EXPECT_EQ(reader.last, "") << "nothing is known yet";
  board.put({{"t", 1.0}, {"link", {{"slave", "COUPLED"}, {"age_s", 0.1}}}, {"gripper", nullptr}});
  reader.catch_up(board);
  EXPECT_EQ(reader.last, R"({"type":"state","gripper":null,"link":{"age_s":0.1,"slave":"COUPLED"},"t":1.0})");
  reader.catch_up(board);
  EXPECT_EQ(reader.last, "");
  board.put({{"t", 1.0}, {"link", {{"slave", "COUPLED"}, {"age_s", 0.2}}}, {"gripper", nullptr}});
  reader.catch_up(board);
  EXPECT_EQ(reader.last, R"({"type":"state","link":{"age_s":0.2}})");
}

TEST(StateDelta, WhoSkipsIsToldTheNewestAlone) {
  StateDelta board;
  Reader quick, slow;
  for (int k = 0; k < 100; ++k) {
    board.put({{"t", k}, {"link", {{"age_s", k}, {"slave", "COUPLED"}}}});
    quick.catch_up(board);
    if (k % 40 == 0) slow.catch_up(board);
  }
  EXPECT_EQ(slow.known.state.at("t"), 80);
  slow.catch_up(board);
  EXPECT_EQ(slow.last, R"({"type":"state","link":{"age_s":99},"t":99})");
  EXPECT_EQ(slow.known.state, quick.known.state);
  EXPECT_EQ(slow.known.told_state.size(), 4U);
}

// Entries come and go as alerts do in a review: whoever reads when, knows in the end what there is.
TEST(StateDelta, EntriesThatAreGoneAreToldAsNullAndForgottenOnceAllHaveHeard) {
  StateDelta board;
  Reader early, late;
  board.put({{"hits", Json::object()}});
  early.catch_up(board);
  EXPECT_EQ(early.last, R"({"type":"state","hits":{}})");
  board.put({{"hits", {{"1", "a"}, {"2", "b"}}}});
  early.catch_up(board);
  late.catch_up(board);
  board.put({{"hits", Json::object()}});
  early.catch_up(board);
  EXPECT_EQ(early.last, R"({"type":"state","hits":{"1":null,"2":null}})");
  board.forget(std::min(early.seen, late.seen));
  board.put({{"hits", {{"2", "c"}}}});
  early.catch_up(board);
  late.catch_up(board);
  EXPECT_EQ(late.last, R"({"type":"state","hits":{"1":null,"2":"c"}})");
  EXPECT_EQ(late.known.state, early.known.state);
  board.forget(std::min(early.seen, late.seen));
  Reader newcomer;
  newcomer.catch_up(board);
  EXPECT_EQ(newcomer.last, R"({"type":"state","hits":{"2":"c"}})") << "1 is forgotten";
}

TEST(StateDelta, WhatTurnsFromNothingIntoAnObjectAndBackIsReplaced) {
  StateDelta board;
  Reader reader;
  for (const Json& words : {Json(), Json{{"key", "banner.no_slave"}, {"values", Json::object()}}, Json(),
                            Json{{"key", "banner.link_lost"}, {"values", {{"age_s", 1}}}}}) {
    board.put({{"banner_words", words}});
    reader.catch_up(board);
    EXPECT_EQ(reader.known.state.at("banner_words"), words);
  }
}

// Names from outside come and go for ever: what is kept does not grow.
TEST(StateDelta, KeepsNoMoreThanThereIs) {
  StateDelta board;
  Reader reader;
  for (int k = 0; k < 1000; ++k) {
    board.put({{"components", {{"a\xFF\"" + std::to_string(k), {{"state", "RUNNING"}}}}}});
    EXPECT_NO_THROW(reader.catch_up(board));
    board.forget(reader.seen);
  }
  Reader newcomer;
  newcomer.catch_up(board);
  EXPECT_EQ(newcomer.known.state.at("components").size(), 1U);
  EXPECT_LT(newcomer.last.size(), 200U);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
