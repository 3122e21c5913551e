#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/survey/error_aid.hpp"
#include "common/survey/identify.hpp"

namespace phantom::survey {

struct SurveyOptions {
  IdentifyOptions identify;
  double least_fit_probability = 0.001;  ///< fits that errors alone make less likely than this are refused
  double confidence = 0.99;              ///< of the reported worst displacement
  /// Poses with a greater worst displacement are refused (thesis: two voxels of 1 cm).
  double largest_displacement_m = 0.02;
  /// A person's choice among alternatives_of(), from 1; 0: none was made. What errors do not explain, or what
  /// is known too badly, is refused all the same.
  std::size_t picked = 0;
};

/// A part that was found, with its pose.
struct FittedObject {
  std::size_t part = 0;  ///< index into the library
  NodeMap map;
  /// Pose by the thesis's fit; none if no face of three corners was measured.
  std::optional<geometry::Pose> four_steps_WO;
  PoseFit fit;                           ///< fitted to all nodes; its covariance includes the head's mounting
  double worst_displacement_m = 0.0;     ///< no point of the part exceeds it, with the options' confidence
  double mounting_displacement_m = 0.0;  ///< the same by the head's mounting alone: no further reading helps
  std::size_t symmetric = 1;             ///< number of poses of this part that occupy the same space
  std::size_t picked_among = 0;          ///< alternatives from which a person chose it; 0: it is the only one
};

/// The result of a survey.
struct SurveyResult {
  Identification identification;
  Choice choice;  ///< what the identification leaves undecided
  /// One for each face. Faces with fewer than three corners have a default one.
  std::vector<FaceCheck> checks;
  std::optional<FittedObject> object;  ///< none: the survey refused
  std::string refusal;                 ///< reason, and what is needed
  std::vector<std::string> advice;     ///< what to measure again or next
};

/// Identifies and fits an object (A.1 to A.5). Refuses if the data do not determine the part or its pose.
/// Pure; not real-time safe.
SurveyResult survey_object(const std::vector<PartModel>& library, const Measurement& measurement,
                           const SurveyOptions& options = {});

/// Returns a text that says why no part agrees.
std::string describe(const NearMiss& miss, const std::vector<PartModel>& library,
                     const Measurement& measurement);

}  // namespace phantom::survey
