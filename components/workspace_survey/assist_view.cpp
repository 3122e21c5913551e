#include "components/workspace_survey/assist_view.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::workspace_survey {
namespace {

/// Returns the direction in which the head sees a point; none if its beam does not reach it.
std::optional<AssistView::Direction> direction_of(const survey::RangeHead& head,
                                                  const Eigen::Vector3d& p_W_m) {
  const auto reading = survey::aim(head, p_W_m);
  if (!reading) return std::nullopt;
  return AssistView::Direction{reading->pan_rad, reading->tilt_rad};
}

}  // namespace

AssistView survey_view(const survey::RangeHead& head, const survey::HeadErrors& errors,
                       const std::vector<survey::Targeting>& targetings, const survey::PartModel* part,
                       const geometry::Pose& X_WO) {
  AssistView view;
  const auto measurement = survey::register_nodes(head, errors, targetings);
  for (std::size_t i = 0; measurement && i < measurement->nodes.size(); ++i) {
    const survey::MeasuredNode& node = measurement->nodes[i];
    const auto direction = direction_of(head, node.p_W_m);
    const auto first = std::ranges::find(targetings, node.name, &survey::Targeting::node);
    if (direction)
      view.nodes.push_back({node.name, first->face, *direction, std::sqrt(node.covariance_m2.trace())});
  }
  if (part == nullptr) return view;
  view.part = part->name;
  for (const auto& [from, to] : survey::sharp_edges(*part)) {
    const auto a = direction_of(head, X_WO * part->nodes_O_m[from]),
               b = direction_of(head, X_WO * part->nodes_O_m[to]);
    if (a && b) view.edges.emplace_back(*a, *b);
  }
  return view;
}

}  // namespace phantom::workspace_survey
