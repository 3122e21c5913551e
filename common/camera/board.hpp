#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/camera/lens.hpp"
#include "common/core/status.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::camera {

/// A checkerboard, by its inner corners: where four squares meet. Frame B: x along a row, y down the columns,
/// origin at the first corner.
struct Board {
  int columns = 9, rows = 6;  ///< inner corners in a row, and rows of them
  double square_m = 0.025;    ///< edge of a square

  Eigen::Vector3d corner_B_m(int number) const {
    return {square_m * (number % columns), square_m * (number / columns), 0.0};
  }
  int corners() const { return columns * rows; }
  /// Returns whether the board looks different when it is turned by half a turn: of columns and rows one must
  /// be odd and one even. The first corner is then the one beyond which, outwards, a dark square lies.
  bool has_first_corner() const { return (columns + rows) % 2 != 0; }
};

/// A grey picture, row by row without padding. The octets must outlive it.
struct GreyPicture {
  int width_px = 0, height_px = 0;
  const std::uint8_t* octets = nullptr;
};

/// Returns the pixels of all inner corners, row by row, to a fraction of a pixel; nothing if the board is not
/// seen as a whole.
std::optional<std::vector<Eigen::Vector2d>> find_corners(const GreyPicture& picture, const Board& board);

/// A lens, and how sure it is.
struct LensFit {
  Lens lens;
  double rms_px = 0.0;                 ///< over all corners of all pictures
  std::vector<double> picture_rms_px;  ///< of each picture
  std::vector<geometry::Pose> X_CB;    ///< where the board was in each picture
  /// How far from the middle of the picture corners were seen, half its diagonal being 1. What lies farther
  /// out is extrapolated; below 0.85 without k3.
  double reach = 0.0;
  double focal_sigma_px = 0.0, centre_sigma_px = 0.0;  ///< standard deviations, the greater of x and y
};

/// Finds a lens from pictures of a board, each with all corners as find_corners() returns them. Refuses fewer
/// than three pictures, boards that were never tilted or did not fill enough of the picture (the focal length
/// is then unsure by more than 2 %), and a residual of more than `largest_rms_px`. Not real-time safe.
core::Expected<LensFit> fit_lens(int width_px, int height_px, const Board& board,
                                 std::span<const std::vector<Eigen::Vector2d>> pictures,
                                 double largest_rms_px = 1.5);

}  // namespace phantom::camera
