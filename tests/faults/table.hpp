#pragma once

// What the tables of faults have in common: the states to begin in, and how a reaction is told.

#include <gtest/gtest.h>

#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "tests/faults/pair.hpp"
#include "tests/support/thorough.hpp"

namespace phantom::faults {

inline constexpr teleop::LinkState kStates[] = {teleop::LinkState::kInit,     teleop::LinkState::kReady,
                                                teleop::LinkState::kAligned,  teleop::LinkState::kCoupled,
                                                teleop::LinkState::kDegraded, teleop::LinkState::kStopped};

inline void step(Pair& pair, int ms) {
  for (int i = 0; i < ms; ++i) pair.step();
}

enum class Side { kMaster, kSlave };
inline const char* name_of(Side side) { return side == Side::kMaster ? "master" : "slave"; }
inline teleop::LinkState state_of(const Pair& pair, Side side) {
  return side == Side::kMaster ? pair.master_state() : pair.slave_state();
}

/// A state of one side in which a fault begins.
struct Beginning {
  Side side;
  teleop::LinkState state;
};
/// Where fault `number` of a table begins: in the long form every state of `sides`; in the quick one coupled
/// and one state more, by turns, so that every state and side is met, by several faults each.
inline std::vector<Beginning> beginnings(std::size_t number, const std::vector<Side>& sides) {
  std::vector<Beginning> all;
  if (test::thorough()) {
    for (const Side side : sides) {
      for (const teleop::LinkState state : kStates) all.push_back({side, state});
    }
    return all;
  }
  constexpr teleop::LinkState kOther[] = {teleop::LinkState::kInit, teleop::LinkState::kReady,
                                          teleop::LinkState::kAligned, teleop::LinkState::kDegraded,
                                          teleop::LinkState::kStopped};
  all.push_back({sides[number % sides.size()], teleop::LinkState::kCoupled});
  all.push_back({sides[(number + 1) % sides.size()], kOther[number % std::size(kOther)]});
  return all;
}

/// Brings the pair to where `side` is in `state`, with drives that follow if there are any; coupled: with the
/// hand under way. Init: nobody has been heard for longer than staleness.
inline void bring_to(Pair& pair, teleop::LinkState state, Side side = Side::kMaster) {
  const auto run_to = [&](teleop::LinkState wanted) {
    for (int i = 0; i < 5000 && state_of(pair, side) != wanted; ++i) pair.step();
    ASSERT_EQ(state_of(pair, side), wanted);
  };
  if (pair.rig) {  // power comes once both hear each other
    for (int i = 0; i < 5000 && !pair.slave_drives().follows; ++i) pair.step();
    ASSERT_TRUE(pair.slave_drives().follows) << pair.slave_drives().message;
  }
  if (pair.rig || state == teleop::LinkState::kInit) {
    pair.up.cut = pair.down.cut = true;
    for (int i = 0; i < 200; ++i) pair.step();
    pair.up.cut = pair.down.cut = false;
  }
  if (state == teleop::LinkState::kInit) return;
  if (state == teleop::LinkState::kReady || state == teleop::LinkState::kAligned) return run_to(state);
  run_to(teleop::LinkState::kCoupled);
  for (int i = 0; i < 1500; ++i) pair.step();
  if (state == teleop::LinkState::kDegraded) {
    bool& cut = side == Side::kMaster ? pair.down.cut : pair.up.cut;
    cut = true;
    run_to(teleop::LinkState::kDegraded);
    cut = false;
  }
  if (state == teleop::LinkState::kStopped) {
    side == Side::kMaster ? pair.signal_master() : pair.signal_slave();
    run_to(teleop::LinkState::kStopped);
    for (int i = 0; i < 20; ++i) pair.step();  // the other hears of it
  }
}

/// The state in which one side is while the fault lasts, and when it came there.
struct Reaction {
  teleop::LinkState reached{};
  std::optional<int> after_ms;  ///< none: it stayed as it was

  void see(teleop::LinkState now, int ms) {
    if (now != reached) *this = {now, ms};
  }
};

inline std::string text(const Reaction& reaction) {
  if (!reaction.after_ms) return "stays " + std::string(name_of(reaction.reached));
  return std::string(name_of(reaction.reached)) + ", " + std::to_string(*reaction.after_ms) + " ms";
}

}  // namespace phantom::faults
