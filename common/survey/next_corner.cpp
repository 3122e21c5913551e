#include "common/survey/next_corner.hpp"

#include <algorithm>

#include "common/survey/visible.hpp"

namespace phantom::survey {

std::optional<PlannedFace> plan_next_face(const PartModel& part, const geometry::Pose& X_WO,
                                          const Measurement& measurement, const NodeMap& map) {
  VisibleOptions options;
  options.most_faces = part.loops.size();
  std::optional<PlannedFace> best;
  std::ptrdiff_t most = 0;
  for (const VisibleFace& face : visible_faces(part, X_WO, measurement.eye_W_m, options)) {
    PlannedFace planned{face.closed, {}};
    for (const std::uint32_t node : face.nodes) {
      PlannedCorner corner{X_WO * part.nodes_O_m[node], std::nullopt};
      const auto known = std::find(map.begin(), map.end(), node);
      if (known != map.end()) corner.measured = static_cast<std::size_t>(known - map.begin());
      planned.corners.push_back(corner);
    }
    const auto is_new = [](const PlannedCorner& corner) { return !corner.measured; };
    const auto adds = std::count_if(planned.corners.begin(), planned.corners.end(), is_new);
    if (adds <= most) continue;
    most = adds;
    best = std::move(planned);
  }
  return best;
}

}  // namespace phantom::survey
