#include "components/simulated_drive/homing.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::simulated_drive {

// CiA 402: to the switch and back to its edge (17, 18: limit switches; 19 to 22: home switch), to the next
// index pulse (33, 34), or where the axis stands (35, 37).
std::vector<Homing::Leg> Homing::legs_of(std::int64_t method) {
  using enum Event;
  switch (method) {
    case 17:
      return {{-1, true, kLowerOn}, {1, false, kLowerOff}};
    case 18:
      return {{1, true, kUpperOn}, {-1, false, kUpperOff}};
    case 19:
      return {{1, true, kHomeOn}, {-1, false, kHomeOff}};
    case 20:
      return {{-1, true, kHomeOff}, {1, false, kHomeOn}};
    case 21:
      return {{-1, true, kHomeOn}, {1, false, kHomeOff}};
    case 22:
      return {{1, true, kHomeOff}, {-1, false, kHomeOn}};
    case 33:
      return {{-1, false, kIndex}};
    case 34:
      return {{1, false, kIndex}};
    default:
      return {};
  }
}

bool Homing::supports(std::int64_t method) {
  return (method >= 17 && method <= 22) || (method >= 33 && method <= 35) || method == 37;
}

void Homing::start(std::int64_t method, const Speeds& speeds, double counts) {
  legs_ = legs_of(method);
  speeds_ = speeds;
  leg_ = 0;
  speed_ = 0.0;
  before_counts_ = counts;
  state_ = supports(method) ? State::kSearching : State::kError;
}

bool Homing::happens(Event event, double counts) const {
  const bool at_home = counts >= switches_.home_from && counts < switches_.home_to;
  const auto turn = [&](double at) { return std::floor((at - switches_.index) / switches_.turn); };
  switch (event) {
    case Event::kLowerOn:
      return counts <= switches_.lower_limit;
    case Event::kLowerOff:
      return counts > switches_.lower_limit;
    case Event::kUpperOn:
      return counts >= switches_.upper_limit;
    case Event::kUpperOff:
      return counts < switches_.upper_limit;
    case Event::kHomeOn:
      return at_home;
    case Event::kHomeOff:
      return !at_home;
    case Event::kIndex:
      return turn(counts) != turn(before_counts_);
  }
  return false;
}

// A limit switch that is not what the leg looks for ends the search.
bool Homing::blocked(const Leg& leg, double counts) const {
  return leg.direction < 0 ? counts <= switches_.lower_limit : counts >= switches_.upper_limit;
}

double Homing::step(double counts, double dt_s) {
  if (!runs()) return 0.0;
  while (state_ == State::kSearching && leg_ < legs_.size() && happens(legs_[leg_].until, counts)) {
    // An index pulse latches its own count; the edge of a switch is where the drive looks.
    if (legs_[leg_].until == Event::kIndex)
      counts =
          switches_.index +
          switches_.turn * std::floor((std::max(counts, before_counts_) - switches_.index) / switches_.turn);
    ++leg_;
  }
  if (state_ == State::kSearching && leg_ == legs_.size()) {
    home_counts_ = std::round(counts);
    state_ = State::kStopping;
  }
  double wanted = 0.0;
  if (state_ == State::kSearching) {
    const Leg& leg = legs_[leg_];
    if (blocked(leg, counts)) state_ = State::kError;
    wanted = state_ == State::kError ? 0.0 : leg.direction * (leg.fast ? speeds_.search : speeds_.zero);
  }
  before_counts_ = counts;
  const double most = speeds_.acceleration * dt_s;
  speed_ += std::clamp(wanted - speed_, -most, most);
  if (state_ == State::kStopping && speed_ == 0.0) state_ = State::kFound;
  return speed_;
}

}  // namespace phantom::simulated_drive
