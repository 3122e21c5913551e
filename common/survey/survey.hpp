#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/survey/error_aid.hpp"
#include "common/survey/identify.hpp"

namespace phantom::survey {

struct SurveyOptions {
  IdentifyOptions identify;
  double least_fit_probability = 0.001;  ///< fits that are less likely by errors alone are refused
  double confidence = 0.99;              ///< of the stated worst displacement
  double largest_displacement_m =
      0.02;  ///< poses that are known worse are refused (thesis: two voxels of 1 cm)
};

/// A part that was found, and where it stands.
struct FittedObject {
  std::size_t part = 0;  ///< index into the library
  NodeMap map;
  std::optional<geometry::Pose>
      four_steps_WO;                  ///< the thesis's fit; none if no face of three corners was measured
  PoseFit fit;                        ///< refined over all nodes
  double worst_displacement_m = 0.0;  ///< that no point of the part exceeds, with the options' confidence
  std::size_t symmetric = 1;          ///< poses of this part that occupy the same space
};

/// What a measurement says.
struct SurveyResult {
  Identification identification;
  Choice choice;                  ///< what the identification leaves open
  std::vector<FaceCheck> checks;  ///< of the faces with three corners or more; default ones for the others
  std::optional<FittedObject> object;  ///< none: refused
  std::string refusal;                 ///< why, and what is needed
  std::vector<std::string> advice;     ///< what to measure again, or next
};

/// Identifies and fits (A.1 to A.5), or refuses where the data do not say what it is or where it stands.
/// Pure; not real-time safe.
SurveyResult survey_object(const std::vector<PartModel>& library, const Measurement& measurement,
                           const SurveyOptions& options = {});

/// Why nothing agrees, in words.
std::string describe(const NearMiss& miss, const std::vector<PartModel>& library,
                     const Measurement& measurement);

}  // namespace phantom::survey
