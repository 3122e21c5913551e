#pragma once

#include <cstdint>
#include <vector>

namespace phantom::simulated_drive {

/// Where the switches and the encoder's index pulses are, in counts of the motor's true angle.
struct HomingSwitches {
  double lower_limit = -1e18, upper_limit = 1e18;  ///< limit switches are active from there outwards
  double home_from = 0.0, home_to = 0.0;  ///< the home switch is active in between; equal: there is none
  double index = 0.0, turn = 65536.0;     ///< one index pulse, and how far it is to the next
};

/// Search for an axis's home: homing mode of CiA 402, methods 17 to 22, 33, 34, 35 and 37.
class Homing {
 public:
  explicit Homing(const HomingSwitches& switches) : switches_(switches) {}
  static bool supports(std::int64_t method);

  struct Speeds {
    double search, zero;  ///< counts/s: to the switch, and to its edge or the index
    double acceleration;  ///< counts/s²
  };
  void start(std::int64_t method, const Speeds& speeds, double counts);
  void stop() { state_ = State::kIdle; }
  /// Advances by dt_s at the true angle `counts`. Returns the speed to move at, in counts/s.
  double step(double counts, double dt_s);

  enum class State { kIdle, kSearching, kStopping, kFound, kError };
  State state() const { return state_; }
  bool runs() const { return state_ == State::kSearching || state_ == State::kStopping; }
  double home_counts() const { return home_counts_; }  ///< the true angle that is home, once it was found

 private:
  enum class Event { kLowerOn, kLowerOff, kUpperOn, kUpperOff, kHomeOn, kHomeOff, kIndex };
  struct Leg {
    int direction;
    bool fast;
    Event until;
  };
  static std::vector<Leg> legs_of(std::int64_t method);
  bool happens(Event event, double counts) const;
  bool blocked(const Leg& leg, double counts) const;

  HomingSwitches switches_;
  State state_ = State::kIdle;
  std::vector<Leg> legs_;
  Speeds speeds_{};
  std::size_t leg_ = 0;
  double speed_ = 0.0, before_counts_ = 0.0, home_counts_ = 0.0;
};

}  // namespace phantom::simulated_drive
