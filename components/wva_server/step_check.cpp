#include "components/wva_server/step_check.hpp"

#include <algorithm>
#include <utility>

#include "common/core/text.hpp"
#include "common/percept/noticeable_steps.hpp"

namespace phantom::wva_server {
namespace {

/// Greatest viscosity of a medium that the body with its layers reaches into.
double medium_around(const layers::Body& body, const runtime::CellConfig& cell) {
  const geometry::BoundingBox box = body.mesh_W.bounding_box();
  const double reach_m = body.profile.reach_vox() * cell.voxel_size_m.reference_m();
  double greatest = 0.0;
  for (const runtime::MediumConfig& medium : cell.media)
    if ((box.max_m.cast<double>().array() + reach_m > medium.min_m.array()).all() &&
        (box.min_m.cast<double>().array() - reach_m < medium.max_m.array()).all())
      greatest = std::max(greatest, medium.mu_Pa_s_per_m);
  return greatest;
}

}  // namespace

std::vector<std::string> unnoticed_step_warnings(const runtime::CellConfig& cell,
                                                 const std::vector<runtime::CellBody>& bodies,
                                                 double weber_fraction) {
  std::vector<std::pair<std::string, std::string>> found;  // steps, objects
  for (const runtime::CellBody& body : bodies) {
    std::string steps;
    for (const std::string& step :
         percept::unnoticed_steps(body.body.profile, weber_fraction, medium_around(body.body, cell)))
      core::add_to_list(steps, step);
    if (steps.empty()) continue;
    const auto same =
        std::find_if(found.begin(), found.end(), [&](const auto& entry) { return entry.first == steps; });
    if (same == found.end()) {
      found.emplace_back(steps, body.body.name);
    } else {
      core::add_to_list(same->second, body.body.name);
    }
  }
  std::vector<std::string> warnings;
  for (const auto& [steps, objects] : found)
    warnings.push_back(core::formatted("%s: an operator who notices %.1f %% feels no step %s",
                                       objects.c_str(), 100.0 * weber_fraction, steps.c_str()));
  return warnings;
}

}  // namespace phantom::wva_server
