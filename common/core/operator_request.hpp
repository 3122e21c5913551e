#pragma once

#include <string>

namespace phantom::core {

/// What a person asks of the running system from the command line.
struct OperatorRequest {
  enum class What { kNone, kStatus, kStop, kReset, kPerceptGain, kFeedbackGain, kLaw, kPercept };
  What what = What::kNone;
  double value = 0.0;      ///< of a gain; number of a law; percept: 1 on, 0 off
  std::string joint_name;  ///< of a gain: of this joint alone; empty: of all
  int joint = -1;          ///< its index from 0; −1: of all
  double timeout_s = 5.0;
};

enum class OperatorOutcome {
  kDone,     ///< everybody who must has confirmed it
  kNotDone,  ///< somebody refused, or did not confirm
  kNobody,   ///< nobody answers at all
};

}  // namespace phantom::core
