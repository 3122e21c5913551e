#include "components/synthetic_viewer/stream/scene_message_log.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace phantom::synthetic_viewer {
namespace {

std::vector<std::string> unseen(const SceneMessageLog& board, std::uint64_t& seen) {
  std::vector<std::string> octets;
  while (const auto next = board.next(seen)) octets.push_back(next->octets);
  return octets;
}

using Texts = std::vector<std::string>;

TEST(SceneBoardOf, EachKindGivesItsNewestMessageOnceAndInOrder) {
  SceneMessageLog board;
  board.put("a", {false, "a1"});
  board.put("b", {false, "b1"});
  std::uint64_t quick = 0, slow = 0;
  EXPECT_EQ(unseen(board, quick), (Texts{"a1", "b1"}));
  EXPECT_EQ(unseen(board, quick), Texts());
  board.put("a", {false, "a2"});
  board.put("a", {false, "a3"});
  board.put("b", {false, "b1"});
  EXPECT_EQ(unseen(board, quick), Texts{"a3"}) << "the same message is none";
  EXPECT_EQ(unseen(board, slow), (Texts{"b1", "a3"})) << "a1 and a2 were replaced before they were sent";
}

TEST(SceneBoardOf, WhatIsGoneIsForgottenOnceAllHaveHeardSo) {
  SceneMessageLog board;
  std::uint64_t slow = 0, quick = 0;
  board.put("a", {false, "a1"});
  board.next(slow);
  board.put_gone("a", {false, "a gone"});
  board.put("b", {false, "b1"});
  EXPECT_EQ(unseen(board, quick), (Texts{"a gone", "b1"}));
  board.forget(slow);
  EXPECT_EQ(board.size(), 2U) << "the slow one has not heard it";
  EXPECT_EQ(unseen(board, slow), (Texts{"a gone", "b1"}));
  board.forget(slow);
  EXPECT_EQ(board.size(), 1U);
  board.put("a", {false, "a1"});
  EXPECT_EQ(unseen(board, slow), Texts{"a1"}) << "it may come again";
}

}  // namespace
}  // namespace phantom::synthetic_viewer
