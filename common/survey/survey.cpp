#include "common/survey/survey.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/text.hpp"
#include "common/core/units.hpp"

namespace phantom::survey {
namespace {

using core::formatted;

constexpr double kGoodRest = 0.05;  // least probability of the nodes without the suspect

class Survey {
 public:
  Survey(const std::vector<PartModel>& library, const Measurement& measurement, const SurveyOptions& options)
      : library_(library), measurement_(measurement), options_(options) {}

  SurveyResult run() {
    if (auto checked = check_measurement(measurement_); !checked) return refused(checked.message());
    if (measurement_.faces.empty()) return refused("nothing was measured");
    look_over_faces();
    result_.identification = identify(library_, measurement_, options_.identify);
    result_.choice = open_choices(result_.identification, options_.identify);
    if (result_.identification.candidates.empty()) return refused(nothing_agrees());
    if (options_.picked > 0) return picked();
    advise_next_edge();
    if (result_.choice.parts.size() > 1)
      return refused("several parts fit as well as each other: " + names_of_parts());
    const Candidate& candidate = result_.identification.candidates.front();
    const Placement& best = candidate.placements.front();
    if (!best.fit) return refused(undetermined(best));
    if (result_.choice.placements.size() > 1) {
      return refused(formatted("%zu poses of ", result_.choice.placements.size()) +
                     library_[candidate.part].name + " fit as well as each other and occupy different space");
    }
    if (!candidate.all_found)
      return refused("too many ways to place " + library_[candidate.part].name +
                     " agree; more must be measured");
    if (best.fit->probability() < options_.least_fit_probability) return refused(misfit(candidate, best));
    return fitted(candidate, best);
  }

 private:
  SurveyResult picked() {
    const auto all = alternatives_of(result_.identification);
    if (options_.picked > all.size())
      return refused(
          formatted("there is no alternative %zu; allowed: 1 to %zu", options_.picked, all.size()));
    const Candidate& candidate = result_.identification.candidates[all[options_.picked - 1].candidate];
    const Placement& placement = candidate.placements[all[options_.picked - 1].placement];
    if (placement.fit->probability() < options_.least_fit_probability)
      return refused(misfit(candidate, placement));
    result_.choice.symmetric = static_cast<std::size_t>(
        std::count_if(candidate.placements.begin(), candidate.placements.end(),
                      [&](const Placement& p) { return p.same_space_as == placement.same_space_as; }));
    SurveyResult result = fitted(candidate, placement);
    if (result.object) result.object->picked_among = all.size();
    return result;
  }

  SurveyResult refused(const std::string& why) {
    result_.refusal = why;
    return std::move(result_);
  }

  void look_over_faces() {
    for (const MeasuredFace& face : measurement_.faces) {
      FaceCheck check;
      if (face.nodes.size() >= 3) check = check_face(measurement_, face);
      if (face.nodes.size() >= 3) {
        for (std::string& said : advice(measurement_, face, check)) result_.advice.push_back(std::move(said));
      }
      result_.checks.push_back(std::move(check));
    }
  }

  std::string nothing_agrees() {
    std::string said =
        formatted("no part of the library's %zu agrees with what was measured", library_.size());
    const auto& miss = result_.identification.near_miss;
    if (!miss) return said;
    if (miss->placement.fit) advise_misfits(library_[miss->part], miss->placement);
    return said + "; the nearest: " + describe(*miss, library_, measurement_);
  }

  std::string names_of_parts() const {
    return core::listed(result_.choice.parts, [&](std::size_t c) {
      return library_[result_.identification.candidates[c].part].name;
    });
  }

  std::string undetermined(const Placement& best) const {
    const auto status =
        refine(library_[result_.identification.candidates.front().part], measurement_, best.map, {}).status();
    return "the measurement does not determine the pose: " + status.message();
  }

  void advise_next_edge() {
    const auto edge = next_edge(library_, measurement_, result_.identification, options_.identify);
    if (!edge) return;
    const auto in_mm = [](double m) { return formatted("%.0f", 1e3 * m); };
    result_.advice.push_back("measure the edge that leaves node '" + measurement_.nodes[edge->node].name +
                             "' off what was measured: its length tells the candidates apart (" +
                             core::listed(edge->lengths_m, in_mm) + " mm)");
  }

  std::string misfit(const Candidate& candidate, const Placement& best) {
    const PartModel& part = library_[candidate.part];
    std::string said = std::string("the nodes lie off the model of ") + part.name +
                       formatted(" more than their errors explain (probability %.1g; allowed: at least %.1g)",
                                 best.fit->probability(), options_.least_fit_probability);
    advise_misfits(part, best);
    return said;
  }

  /// Puts the advice on bad ranges first: the model detects them more sharply than a face alone.
  void advise_misfits(const PartModel& part, const Placement& placement) {
    std::vector<std::string> said;
    for (const Misfit& m : find_misfits(part, measurement_, placement.map, *placement.fit, kGoodRest)) {
      said.push_back("measure node '" + measurement_.nodes[m.node].name +
                     "' again: without it the others fit " + part.name +
                     formatted("; it lies %.1f mm off, its range is %.1f mm too %s", 1e3 * m.off_m,
                               1e3 * std::abs(m.along_beam_m), m.along_beam_m > 0 ? "long" : "short"));
    }
    result_.advice.insert(result_.advice.begin(), said.begin(), said.end());
  }

  SurveyResult fitted(const Candidate& candidate, const Placement& best) {
    const PartModel& part = library_[candidate.part];
    FittedObject object{.part = candidate.part, .map = best.map, .four_steps_WO = {}, .fit = *best.fit};
    object.symmetric = result_.choice.symmetric;
    PoseFit mounting = object.fit;
    mounting.covariance = mounting_covariance_of(object.fit, measurement_);
    object.fit.covariance += mounting.covariance;
    object.worst_displacement_m = worst_displacement_m(part, object.fit, options_.confidence);
    object.mounting_displacement_m = worst_displacement_m(part, mounting, options_.confidence);
    if (!(object.worst_displacement_m <= options_.largest_displacement_m)) {
      result_.advice.push_back(
          object.mounting_displacement_m > options_.largest_displacement_m
              ? "survey the head's mounting better: alone it may displace the part by " +
                    formatted("%.1f mm", 1e3 * object.mounting_displacement_m)
              : "measure corners that lie farther apart, or on another face; or each corner several times");
      return refused(
          std::string("the pose is known too badly: some point of ") + part.name +
          formatted(
              " may be %.1f mm off (%.0f %% confidence), it may be turned by %.2f deg; allowed: %.1f mm",
              1e3 * object.worst_displacement_m, 100 * options_.confidence,
              object.fit.orientation_sigma_rad() / core::kRadPerDegree,
              1e3 * options_.largest_displacement_m));
    }
    const auto largest = std::max_element(
        measurement_.faces.begin(), measurement_.faces.end(), [&](const auto& a, const auto& b) {
          const auto size = [&](const MeasuredFace& f) {
            return f.nodes.size() < 3
                       ? -1.0
                       : face_metrics(corners_of(measurement_, f), f.closed, measurement_.eye_W_m).area_m2;
          };
          return size(a) < size(b);
        });
    if (largest->nodes.size() >= 3) {
      object.four_steps_WO = fit_four_steps(part, measurement_, *largest, best.map,
                                            largest_triangle(corners_of(measurement_, *largest)),
                                            best_anchor(measurement_, *largest));
    }
    result_.object = std::move(object);
    return std::move(result_);
  }

  const std::vector<PartModel>& library_;
  const Measurement& measurement_;
  const SurveyOptions& options_;
  SurveyResult result_;
};

}  // namespace

SurveyResult survey_object(const std::vector<PartModel>& library, const Measurement& measurement,
                           const SurveyOptions& options) {
  return Survey(library, measurement, options).run();
}

std::string describe(const NearMiss& miss, const std::vector<PartModel>& library,
                     const Measurement& measurement) {
  return library[miss.part].name + ", but nodes '" + measurement.nodes[miss.node_a].name + "' and '" +
         measurement.nodes[miss.node_b].name +
         formatted("' are %.1f mm apart, there %.1f mm (%.1f standard deviations)", 1e3 * miss.measured_m,
                   1e3 * miss.modelled_m, miss.sigmas);
}

}  // namespace phantom::survey
