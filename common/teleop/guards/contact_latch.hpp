#pragma once

namespace phantom::teleop {

/// Contact as measured forces tell it. It begins when the greatest force exceeds its threshold, and ends when
/// all have been below kReleaseShare of theirs for kHold_s, so that noise about a threshold is one contact.
class ContactLatch {
 public:
  static constexpr double kReleaseShare = 0.8, kHold_s = 0.05;

  /// Takes the greatest of all shares |force| ÷ threshold, `dt_s` after the one before. Returns whether there
  /// is contact. Real-time safe: yes.
  bool step(double greatest_share, double dt_s) noexcept {
    quiet_s_ = greatest_share < kReleaseShare ? quiet_s_ + dt_s : 0.0;
    return contact_ = greatest_share > 1.0 || (contact_ && quiet_s_ < kHold_s);
  }
  /// Ends the contact, as nothing is known of it.
  void release() noexcept { contact_ = false; }

 private:
  bool contact_ = false;
  double quiet_s_ = 0.0;
};

}  // namespace phantom::teleop
