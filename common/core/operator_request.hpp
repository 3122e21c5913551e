#pragma once

#include <string>

namespace phantom::core {

/// A person's request to the running system, from the command line.
struct OperatorRequest {
  enum class What { kNone, kStatus, kStop, kReset, kPerceptGain, kFeedbackGain, kLaw, kPercept };
  What what = What::kNone;
  double value = 0.0;      ///< the gain, or the law's number; for the percept: 1 on, 0 off
  std::string joint_name;  ///< the joint whose gain is set; empty: all
  int joint = -1;          ///< that joint's index from 0; −1: all
  double timeout_s = 5.0;
};

enum class OperatorOutcome {
  kDone,     ///< every side that must answer has confirmed
  kNotDone,  ///< a side refused, or did not confirm
  kNobody,   ///< no side answered at all
};

}  // namespace phantom::core
