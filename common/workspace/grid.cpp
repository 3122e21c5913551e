#include "common/workspace/grid.hpp"

#include "common/core/text.hpp"

namespace phantom::workspace {

core::Status check_voxel_size(const VoxelSize& size) {
  const Eigen::Vector3d& sides_m = size.sides_m();
  if (!sides_m.allFinite() || !(sides_m.minCoeff() > 0.0))
    return core::Status::invalid_argument("is not above 0");
  Eigen::Index longest = 0, shortest = 0;
  const double ratio = sides_m.maxCoeff(&longest) / sides_m.minCoeff(&shortest);
  // A millionth of reserve keeps 0.8 ÷ 0.1 at 8, however the quotient is rounded.
  if (ratio <= kMaxStretch * (1.0 + 1e-6)) return core::Status::ok();
  return core::Status::invalid_argument(
      core::formatted("is %.4g times as long along %c as along %c; allowed: at most %g times", ratio,
                      "xyz"[longest], "xyz"[shortest], kMaxStretch));
}

}  // namespace phantom::workspace
