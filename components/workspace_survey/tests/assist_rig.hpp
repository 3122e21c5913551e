#pragma once

#include <optional>
#include <sstream>

#include "common/runtime/configuration/pose_text.hpp"
#include "common/survey/simulated_ranger.hpp"
#include "components/workspace_survey/assist.hpp"
#include "components/workspace_survey/tests/rig.hpp"
#include "components/workspace_survey/tests/survey_person.hpp"

namespace phantom::workspace_survey {

/// A simulated head in this process.
class HeadInProcess final : public SteeredHead {
 public:
  HeadInProcess(const survey::RangeHead& head, const survey::HeadErrors& errors, survey::RangerScene scene)
      : ranger_(head, errors, std::move(scene), 11) {}
  const HeadDescription& description() const override { return description_; }
  core::Expected<survey::Reading> aim(double pan_rad, double tilt_rad) override {
    return ranger_.aim(pan_rad, tilt_rad);
  }
  core::Expected<std::vector<survey::Reading>> measure(int readings) override {
    std::vector<survey::Reading> all;
    for (int i = 0; i < readings; ++i) {
      const auto reading = ranger_.measure();
      if (!reading) return reading.status();
      all.push_back(*reading);
    }
    return all;
  }

 private:
  HeadDescription description_{"in this process", -3.0, 3.0, 0.0, 3.1};
  survey::SimulatedRanger ranger_;
};

class AssistHead : public testing::Test {
 protected:
  AssistHead() {
    config_.errors.pan_rad = config_.errors.tilt_rad =
        0.002 * core::kRadPerDegree;  // it stands where it says
    X_WO_ = *runtime::parse_pose("0.1 0 0.4 90 0 20");
  }
  /// The head, as it is mounted with the errors of a seed, over the part, a metre in front of a wall.
  void mount(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    mounted_ = survey::simulate_mounting(config_.head, config_.errors, random);
    geometry::TriangleMesh scene = part().mesh_O.transformed(X_WO_);
    const Eigen::Vector3f ahead =
        (X_WO_.translation_m - mounted_.X_WH.translation_m).normalized().cast<float>();
    const Eigen::Vector3f middle = X_WO_.translation_m.cast<float>() + ahead,
                          u = 5.0F * ahead.unitOrthogonal(), v = ahead.cross(u);
    geometry::TriangleMesh wall;
    wall.vertices_m = {middle - u - v, middle + u - v, middle + u + v, middle - u + v};
    wall.triangles = {{0, 1, 2}, {0, 2, 3}};
    scene.append(wall);
    head_.emplace(mounted_, config_.errors, survey::RangerScene(scene));
  }
  const survey::PartModel& part() const {
    return shipped_library().models[find_part(shipped_library(), "v_groove_block")];
  }
  SurveyPerson person() const { return {part(), X_WO_, mounted_, config_.errors}; }
  std::vector<survey::VisibleFace> faces() const {
    return survey::visible_faces(part(), X_WO_, mounted_.X_WH.translation_m);
  }
  std::string dialogue(const std::string& typed) {
    std::istringstream in(typed);
    std::ostringstream out;
    exit_code_ = assist(config_, shipped_library(), setup(), in, out);
    return out.str();
  }
  AssistSetup setup() {
    AssistSetup setup;
    setup.head = &*head_;
    setup.save = [this](const std::string&, const std::vector<survey::Targeting>& targetings) {
      saved_ = targetings;
      return "kept";
    };
    return setup;
  }

  Config config_ = shipped_config();
  geometry::Pose X_WO_;
  survey::RangeHead mounted_;
  std::optional<HeadInProcess> head_;
  std::vector<survey::Targeting> saved_;
  int exit_code_ = -1;
};

}  // namespace phantom::workspace_survey
