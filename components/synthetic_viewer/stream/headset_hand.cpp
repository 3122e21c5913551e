#include "components/synthetic_viewer/stream/headset_hand.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "phantom_stream/scene_stream.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr core::Nanoseconds kHandForgotten_ns =
    2 * core::kNsPerSecond;                               // so long silent, a page has the hand
constexpr double kFarthest_m = 10.0, kUnitWithin = 0.01;  // what is a pose at all
// What a hand does not do between two poses.
constexpr double kFastest_m_s = 5.0, kJump_m = 0.02, kFastest_rad_s = 30.0, kJump_rad = 0.1;
constexpr double kAhead_m = 0.05, kAhead_rad = 0.3;
constexpr double kBandwidth_rad_s = 40.0, kMaxStep_s = 0.002;
constexpr double kClocksApart = 1e-3;  // s per s, by which two clocks drift apart at most

double angle_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return geometry::rotation_vector(a * b.transpose()).norm();
}

}  // namespace

core::Expected<ControllerPose> controller_pose(std::string_view octets) {
  const auto no = [](const char* why) { return core::Status::invalid_argument(why); };
  using scene_stream::Hand;
  if (octets.size() != Hand::kBytes || octets[0] != static_cast<char>(Hand::kKind))
    return no("a hand is expected: 44 octets, the first 3");
  const Hand hand = Hand::read(octets);
  if ((hand.flags & ~Hand::kAllFlags) != 0) return no("hand: an unknown flag; allowed: 1, 2");
  ControllerPose pose;
  pose.tracked = (hand.flags & Hand::kTracked) != 0;
  pose.grip = (hand.flags & Hand::kGrip) != 0;
  pose.trigger = hand.trigger;
  pose.number = hand.number;
  pose.page_s = hand.time_s;
  pose.position_m = Eigen::Map<const Eigen::Vector3f>(hand.position_m.data()).cast<double>();
  const Eigen::Vector4d turn = Eigen::Map<const Eigen::Vector4f>(hand.turn.data()).cast<double>();
  if (!std::isfinite(pose.page_s) || !pose.position_m.allFinite() || !turn.allFinite())
    return no("hand: a number that is none");
  if (pose.position_m.cwiseAbs().maxCoeff() > kFarthest_m) return no("hand: farther away than 10 m");
  if (std::abs(turn.norm() - 1.0) > kUnitWithin) return no("hand: no unit quaternion");
  pose.R_WC = geometry::rotation_from_quaternion(turn.normalized());
  return pose;
}

const char* name_of(HandWord word) {
  constexpr std::array kNames{"free",      "elsewhere", "forbidden",   "ready",  "leads",
                              "clutch_in", "not_taken", "not_coupled", "silent", "late",
                              "untracked", "jumped",    "end"};
  return kNames[static_cast<std::size_t>(word)];
}

bool HeadsetHand::claim(std::uint64_t page, core::Nanoseconds now_ns) {
  const std::lock_guard lock(mutex_);
  if (holder_ != 0) return holder_ == page;
  holder_ = page;
  heard_ns_ = now_ns;
  let_go(HandWord::kClutchIn);
  return true;
}

void HeadsetHand::leave(std::uint64_t page) {
  const std::lock_guard lock(mutex_);
  if (holder_ == page) forget();
}

bool HeadsetHand::is_of(std::uint64_t page) const {
  const std::lock_guard lock(mutex_);
  return holder_ == page;
}

void HeadsetHand::forget() {
  let_go(HandWord::kClutchIn);
  holder_ = 0;
  least_delay_s_.reset();
  newest_.reset();
}

void HeadsetHand::let_go(HandWord why) {
  trouble_ = why;
  seen_out_ = gripping_ = false;
  last_.reset();
}

core::Status HeadsetHand::take(std::uint64_t page, std::string_view octets, core::Nanoseconds now_ns) {
  const std::lock_guard lock(mutex_);
  if (holder_ != page) return core::Status::ok();
  const auto pose = controller_pose(octets);
  if (!pose || (newest_ && (pose->number <= newest_->number || pose->page_s <= newest_->page_s))) {
    forget();
    return pose ? core::Status::invalid_argument("hand: number and time are to rise") : pose.status();
  }
  heard_ns_ = now_ns;
  newest_ = *pose;
  if (late(*pose, now_ns)) {
    let_go(HandWord::kLate);
  } else if (!pose->tracked) {
    let_go(HandWord::kUntracked);
  } else if (pose->grip && jumped(*pose)) {  // with the button let go it leads nothing anyway
    let_go(HandWord::kJumped);
    last_ = *pose;
  } else {
    if (!pose->grip) {
      seen_out_ = true;
      trouble_.reset();
    } else if (trouble_ && trouble_ != HandWord::kJumped) {
      trouble_ = HandWord::kClutchIn;
    }
    follow(*pose);
  }
  return core::Status::ok();
}

// A page whose messages are held up on the way says where the hand was, not where it is.
bool HeadsetHand::late(const ControllerPose& pose, core::Nanoseconds now_ns) {
  const double delay_s = core::seconds(now_ns) - pose.page_s;
  if (least_delay_s_) *least_delay_s_ += kClocksApart * core::seconds(now_ns - delayed_ns_);
  delayed_ns_ = now_ns;
  least_delay_s_ = std::min(least_delay_s_.value_or(delay_s), delay_s);
  return delay_s - *least_delay_s_ > core::seconds(silent_ns_);
}

bool HeadsetHand::jumped(const ControllerPose& pose) const {
  if (!last_) return false;
  const double dt_s = std::min(pose.page_s - last_->page_s, core::seconds(silent_ns_));
  return (pose.position_m - last_->position_m).norm() > kJump_m + kFastest_m_s * dt_s ||
         angle_between(pose.R_WC, last_->R_WC) > kJump_rad + kFastest_rad_s * dt_s;
}

// What the hand has done since the last pose, the handle is to do until the next.
void HeadsetHand::follow(const ControllerPose& pose) {
  if (gripping_ && last_) {
    const double dt_s = std::clamp(pose.page_s - last_->page_s, kMaxStep_s, core::seconds(silent_ns_));
    target_.translation_m += R_BW_ * (pose.position_m - last_->position_m);
    target_.rotation = R_BW_ * pose.R_WC * last_->R_WC.transpose() * R_BW_.transpose() * target_.rotation;
    aim_twist_ << (target_.translation_m - aim_.translation_m) / dt_s,
        geometry::rotation_vector(target_.rotation * aim_.rotation.transpose()) / dt_s;
    aim_left_s_ = dt_s;
  }
  last_ = pose;
}

HeadsetHand::Handle HeadsetHand::step(const Felt& felt, double dt_s, core::Nanoseconds now_ns) {
  const std::lock_guard lock(mutex_);
  felt_ = felt;
  if (felt.taken) taken_ns_ = now_ns;
  if (holder_ != 0 && now_ns - heard_ns_ > silent_ns_) let_go(HandWord::kSilent);
  if (holder_ != 0 && now_ns - heard_ns_ > kHandForgotten_ns) forget();
  free_s_ = holder_ == 0 ? free_s_ + dt_s : 0.0;
  const bool ready = holder_ != 0 && !trouble_;
  const bool taken = taken_ns_ != 0 && now_ns - taken_ns_ <= silent_ns_;
  felt_.taken = taken;
  if (!taken || handle_.spent()) seen_out_ = false;
  const bool grips = ready && seen_out_ && newest_->grip;
  if (grips && !gripping_) {
    target_ = aim_ = handle_.pose();
    aim_left_s_ = 0.0;
  }
  gripping_ = grips;
  if (grips) {
    move(felt.wrench, dt_s);
  } else {
    handle_.rest(dt_s);
  }
  return {.hand = {.pose = handle_.pose(),
                   .twist = handle_.twist(),
                   .clutch = grips,
                   .valid = ready || free_s_ >= teleop::FreeHandle::kRests_s},
          .grip_opening = ready ? 1.0 - newest_->trigger : -1.0};
}

void HeadsetHand::move(const robot::Spatial& wrench, double dt_s) {
  for (double left_s = dt_s; left_s > 1e-9; left_s -= kMaxStep_s) {
    const double h_s = std::min(left_s, kMaxStep_s), moved_s = std::min(h_s, aim_left_s_);
    aim_.translation_m += moved_s * aim_twist_.head<3>();
    aim_.rotation = geometry::rotation_from_vector(moved_s * aim_twist_.tail<3>()) * aim_.rotation;
    aim_left_s_ -= moved_s;
    Eigen::Vector3d ahead_m = aim_.translation_m - handle_.pose().translation_m;
    Eigen::Vector3d ahead_rad =
        geometry::rotation_vector(aim_.rotation * handle_.pose().rotation.transpose());
    const Eigen::Vector3d too_far_m = ahead_m;
    teleop::shorten(ahead_m, kAhead_m);
    aim_.translation_m += ahead_m - too_far_m;
    target_.translation_m += ahead_m - too_far_m;
    if (ahead_rad.norm() > kAhead_rad) {
      teleop::shorten(ahead_rad, kAhead_rad);
      aim_.rotation = target_.rotation = geometry::rotation_from_vector(ahead_rad) * handle_.pose().rotation;
      aim_twist_.tail<3>().setZero();
    }
    robot::Spatial ahead;
    ahead << ahead_m, ahead_rad;
    handle_.lead(moved_s / h_s * aim_twist_ + 0.5 * kBandwidth_rad_s * ahead, wrench, h_s);
  }
}

HandWord HeadsetHand::word(std::uint64_t page) const {
  const std::lock_guard lock(mutex_);
  if (holder_ == 0) return HandWord::kFree;
  return holder_ == page ? held_word() : HandWord::kElsewhere;
}

HandWord HeadsetHand::held_word() const {
  if (trouble_) return *trouble_;
  if (handle_.spent()) return HandWord::kEnd;
  if (!felt_.taken) return HandWord::kNotTaken;
  if (!gripping_) return newest_ && newest_->grip && !seen_out_ ? HandWord::kClutchIn : HandWord::kReady;
  return felt_.leads ? HandWord::kLeads : HandWord::kNotCoupled;
}

}  // namespace phantom::synthetic_viewer
