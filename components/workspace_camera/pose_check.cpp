#include "components/workspace_camera/pose_check.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "components/workspace_camera/depth_raster.hpp"

namespace phantom::workspace_camera {
namespace {

constexpr double kDisagree = 0.25;         // of an object's pixels: it may stand elsewhere
constexpr double kSomeSeenThrough = 0.04;  // and kMinPixels: likewise, as no other thing can be the reason
constexpr double kSeenThrough = 0.85;      // of them: nothing is there
constexpr double kConfirmed = 0.7;         // of the pixels at the new pose: it stands there
constexpr double kSigmas = 4.0;
constexpr double kSlide_m = 0.025;  // steps in which a slid object is looked for
constexpr double kClearly = 1.03;   // so many more pixels speak for the better one of two poses
constexpr std::size_t kMaxNear = 600, kMaxTouches = 40, kMaxFree = 12, kMinTouches = 12;

/// Returns at most `count` of the values, evenly spread.
template <class Value>
std::vector<Value> spread(const std::vector<Value>& all, std::size_t count) {
  if (all.size() <= count) return all;
  std::vector<Value> some;
  for (std::size_t i = 0; i < count; ++i) some.push_back(all[i * all.size() / count]);
  return some;
}

std::vector<ModelObject> with_triangles(std::vector<ModelObject> objects) {
  std::erase_if(objects, [](const ModelObject& one) { return survey::TouchSurface(one.mesh_O).empty(); });
  return objects;
}

/// Returns the best pose near one of these. A later one counts only if it is clearly better.
geometry::Pose best_of(PoseRefinement& refinement, std::initializer_list<geometry::Pose> starts_WO) {
  std::optional<geometry::Pose> best_WO;
  double best = 0.0;
  for (const geometry::Pose& start_WO : starts_WO) {
    const geometry::Pose found_WO = refinement.best_near(start_WO);
    const double score = refinement.score(found_WO);
    if (best_WO && score <= kClearly * best) continue;
    best_WO = found_WO;
    best = score;
  }
  return *best_WO;
}

/// The object is looked for within reach; what lies farther off is explained by something else.
survey::TouchOptions touch_options(double reach_m) {
  survey::TouchOptions options;
  options.prior_position_sigma_m = 0.5 * reach_m;
  options.prior_orientation_sigma_rad = 0.1;
  options.determined_m = 0.02;
  options.least_fit_probability = 0.0;  // the camera's errors are not independent
  return options;
}

/// Root mean square of the distances of points from the surface, of those that may be its.
double residual_m(const survey::TouchSurface& surface, const geometry::Pose& X_WO,
                  const std::vector<survey::Touch>& points, double tolerance_m) {
  const geometry::Pose X_OW = X_WO.inverse();
  double sum = 0.0;
  std::size_t count = 0;
  for (const survey::Touch& point : points) {
    const double distance_m = surface.nearest(X_OW * point.p_W_m).distance_m;
    if (std::abs(distance_m) > tolerance_m) continue;
    sum += distance_m * distance_m;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0.0;
}

}  // namespace

bool is_same(const Place& a, const Place& b) {
  if (!a || !b) return a.has_value() == b.has_value();
  return a->translation_m == b->translation_m && a->rotation == b->rotation;
}

PoseCheck::PoseCheck(const PoseCheckRules& rules, std::vector<ModelObject> objects)
    : rules_(rules), objects_(with_triangles(std::move(objects))) {
  for (const ModelObject& object : objects_) surfaces_.emplace_back(object.mesh_O);
  known_.resize(objects_.size());
}

void PoseCheck::draw(std::size_t object, const geometry::Pose& X_WO, std::vector<Drawn>& into) {
  draw_mesh(objects_[object].mesh_O, image_->X_WC().inverse() * X_WO, image_->camera(), corners_m_,
            [&](std::size_t pixel, double depth_m, double) {
              Drawn& drawn = into[pixel];
              if (drawn.object >= 0 && depth_m >= static_cast<double>(drawn.depth_m)) return;
              drawn = {static_cast<float>(depth_m), static_cast<int>(object)};
            });
}

double PoseCheck::tolerance_m(double depth_m) const {
  return rules_.tolerance_m + kSigmas * rules_.sigma.at(depth_m);
}

/// At the edge of a silhouette a pixel sees one thing or the other.
bool PoseCheck::is_inside(const std::vector<Drawn>& drawn, std::size_t pixel) const {
  const auto width = static_cast<std::size_t>(image_->camera().width_px);
  const std::size_t column = pixel % width;
  if (column == 0 || column + 1 == width || pixel < width || pixel + width >= drawn.size()) return false;
  const Drawn& own = drawn[pixel];
  const double jump_m = tolerance_m(static_cast<double>(own.depth_m));
  for (const std::size_t other : {pixel - 1, pixel + 1, pixel - width, pixel + width})
    if (drawn[other].object != own.object ||
        std::abs(static_cast<double>(drawn[other].depth_m - own.depth_m)) > jump_m)
      return false;
  return true;
}

/// At the arm's edge, too: what is measured there lies between the arm and what is behind it.
bool PoseCheck::is_of_arm(std::size_t pixel) const {
  if (arm_depth_m_.empty()) return false;
  const auto width = static_cast<std::size_t>(image_->camera().width_px);
  const auto seen_m = static_cast<double>(image_->depth_m()[pixel]);
  const auto covers = [&](std::size_t at) {
    return at < arm_depth_m_.size() && arm_depth_m_[at] > 0.0F &&
           seen_m > static_cast<double>(arm_depth_m_[at]) - kArmMargin_m;
  };
  return covers(pixel) || covers(pixel + 1) || covers(pixel - 1) || covers(pixel + width) ||
         covers(pixel - width);
}

void PoseCheck::count(const std::vector<Drawn>& drawn, std::vector<Count>& counts) const {
  counts.assign(objects_.size(), {});
  for (std::size_t pixel = 0; pixel < drawn.size(); ++pixel) {
    if (drawn[pixel].object < 0 || !is_inside(drawn, pixel)) continue;
    const auto model_m = static_cast<double>(drawn[pixel].depth_m),
               seen_m = static_cast<double>(image_->depth_m()[pixel]);
    if (seen_m == 0.0 || is_of_arm(pixel)) continue;
    Count& count = counts[static_cast<std::size_t>(drawn[pixel].object)];
    const double tolerance = tolerance_m(std::max(model_m, seen_m));
    if (std::abs(seen_m - model_m) <= tolerance) {
      ++count.agree;
    } else {
      ++(seen_m > model_m ? count.through : count.hidden);
    }
  }
}

/// What the image says of the object where it is drawn.
PoseCheck::Count PoseCheck::count_at(std::size_t object, const geometry::Pose& X_WO) {
  moved_ = drawn_;
  for (Drawn& drawn : moved_)
    if (drawn.object == static_cast<int>(object)) drawn = {};
  draw(object, X_WO, moved_);
  std::vector<Count> counts;
  count(moved_, counts);
  return counts[object];
}

/// Drawn there, it is what the camera sees.
bool PoseCheck::stands_there(const Count& there) {
  return there.agree >= kMinPixels / 2 &&
         static_cast<double>(there.agree) >= kConfirmed * static_cast<double>(there.judged());
}

/// What the image says of the object's pose, whatever is drawn of it now.
PoseRefinement::Evidence PoseCheck::evidence_of(std::size_t object) {
  moved_.assign(drawn_.size(), {});
  for (std::size_t i = 0; i < objects_.size(); ++i)
    if (i != object && places_[i]) draw(i, *places_[i], moved_);
  PoseRefinement::Evidence evidence;
  evidence.seen_m.assign(image_->depth_m().begin(), image_->depth_m().end());
  evidence.tolerance_m.resize(drawn_.size());
  evidence.explained.resize(drawn_.size());
  for (std::size_t pixel = 0; pixel < drawn_.size(); ++pixel) {
    const auto seen_m = static_cast<double>(evidence.seen_m[pixel]);
    const double tolerance = tolerance_m(seen_m);
    evidence.tolerance_m[pixel] = static_cast<float>(tolerance);
    if (is_of_arm(pixel)) evidence.seen_m[pixel] = 0.0F;
    const Drawn& other = moved_[pixel];
    if (other.object >= 0 && std::abs(seen_m - static_cast<double>(other.depth_m)) <= tolerance)
      evidence.explained[pixel] = 1;
  }
  return evidence;
}

/// Returns the best pose to which the object may have been slid on its place.
geometry::Pose PoseCheck::slid(PoseRefinement& refinement, const geometry::Pose& X_WO) const {
  geometry::Pose best_WO = X_WO;
  double best = refinement.score(X_WO);
  const int steps = static_cast<int>(rules_.reach_m / kSlide_m);
  for (int x = -steps; x <= steps; ++x) {
    for (int y = -steps; y <= steps; ++y) {
      geometry::Pose slid_WO = X_WO;
      slid_WO.translation_m += Eigen::Vector3d(x * kSlide_m, y * kSlide_m, 0.0);
      const double score = refinement.score(slid_WO);
      if (score <= best) continue;
      best = score;
      best_WO = slid_WO;
    }
  }
  return best_WO;
}

/// The points that were measured around the object, and places of the model's surface that were seen through.
/// What other objects explain is left out.
PoseCheck::Measured PoseCheck::measured_around(std::size_t object, const geometry::Pose& X_WO) const {
  const auto& camera = image_->camera();
  const auto width = static_cast<std::size_t>(camera.width_px);
  const survey::TouchSurface& surface = surfaces_[object];
  const geometry::Pose X_OW = X_WO.inverse();
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& corner : surface.extremes_O_m()) box.extend(corner);
  Measured measured;
  for (std::size_t pixel = 0; pixel < drawn_.size(); ++pixel) {
    const auto seen_m = static_cast<double>(image_->depth_m()[pixel]);
    if (seen_m == 0.0 || is_of_arm(pixel)) continue;
    const Eigen::Vector3d ray_C =
        camera.direction(static_cast<double>(pixel % width), static_cast<double>(pixel / width));
    const Drawn& model = drawn_[pixel];
    const auto model_m = static_cast<double>(model.depth_m);
    const bool own = model.object == static_cast<int>(object),
               agrees =
                   model.object >= 0 && std::abs(seen_m - model_m) <= tolerance_m(std::max(model_m, seen_m));
    if (own && !agrees && seen_m > model_m && is_inside(drawn_, pixel))
      measured.free.push_back({image_->X_WC() * (model_m * ray_C), 0.0, rules_.tolerance_m});
    if (agrees && !own) continue;
    const Eigen::Vector3d p_W_m = image_->X_WC() * (seen_m * ray_C);
    if (box.exteriorDistance(X_OW * p_W_m) > rules_.reach_m) continue;
    measured.near.push_back({p_W_m, 0.0, std::hypot(rules_.sigma.at(seen_m), 0.002), std::nullopt});
  }
  measured.near = spread(measured.near, kMaxNear);
  std::erase_if(measured.near, [&](const survey::Touch& touch) {
    return std::abs(surface.nearest(X_OW * touch.p_W_m).distance_m) > rules_.reach_m;
  });
  return measured;
}

bool PoseCheck::fit(std::size_t object, const geometry::Pose& X_WO, PoseFinding& finding) {
  const survey::TouchSurface& surface = surfaces_[object];
  const Eigen::Vector3d& centre_O_m = surface.centre_O_m();
  const Measured measured = measured_around(object, X_WO);
  if (measured.near.size() < kMinTouches) return false;
  const survey::TouchOptions options = touch_options(rules_.reach_m);
  const auto fitted = survey::correct_by_touch(surface, X_WO, spread(measured.near, kMaxTouches),
                                               spread(measured.free, kMaxFree), options);
  if (!fitted) return false;
  const PoseRefinement::Evidence evidence = evidence_of(object);
  double radius_m = 0.0;
  for (const Eigen::Vector3d& corner : surface.extremes_O_m())
    radius_m = std::max(radius_m, (corner - centre_O_m).norm());
  PoseRefinement refinement(image_->camera(), image_->X_WC(), evidence, objects_[object].mesh_O, centre_O_m,
                            radius_m);
  // What is hardly seen is left as in the model, unless the image then denies it.
  const geometry::Pose determined_WO = survey::determined_pose(*fitted, centre_O_m, options),
                       found_WO =
                           best_of(refinement, {determined_WO, fitted->fit.X_WO, slid(refinement, X_WO)});
  finding.corrected_WO = found_WO;
  finding.shift_m = found_WO * centre_O_m - X_WO * centre_O_m;
  finding.turned_rad = geometry::rotation_vector(found_WO.rotation * X_WO.rotation.transpose()).norm();
  finding.residual_m = residual_m(surface, found_WO, measured.near, rules_.tolerance_m);
  for (const survey::TouchDirection& direction : fitted->open)
    if (!refinement.tells_apart(found_WO, options.determined_m / direction.sigma_m * direction.motion))
      finding.open.push_back(direction.words);
  return finding.shift_m.norm() + finding.turned_rad * radius_m > rules_.tolerance_m &&
         refinement.score(found_WO) > kClearly * refinement.score(X_WO) &&
         stands_there(count_at(object, found_WO));
}

/// Hidden pixels may be those of something before the object, but what it hides can only be seen if it is not
/// there.
bool PoseCheck::seems_moved(const Count& seen) {
  return seen.through >= kMinPixels &&
         static_cast<double>(seen.through) >= kSomeSeenThrough * static_cast<double>(seen.judged());
}

/// Finds where an object stands that is not where the model has it.
void PoseCheck::find(std::size_t object, const geometry::Pose& X_WO, const Count& seen, int& fits,
                     PoseFinding& finding) {
  std::optional<Known>& known = known_[object];
  if (known && !is_same(known->X_WO, X_WO)) known.reset();
  const PoseFinding counted = finding;
  const auto keep = [&] {
    finding = known->finding;
    finding.pixels = counted.pixels;
    finding.agree = counted.agree;
    finding.through = counted.through;
  };
  if (known && known->finding.verdict == PoseVerdict::kElsewhere) {
    const Count there = count_at(object, known->finding.corrected_WO);
    if (!stands_there(there))
      known.reset();
    else if (!seems_moved(there))
      return keep();
  }
  if (known && known->rest > 0) {
    --known->rest;
    return keep();
  }
  if (fits <= 0) return;
  --fits;
  first_ = (object + 1) % objects_.size();
  const auto through = static_cast<double>(seen.through), judged = static_cast<double>(seen.judged());
  if (fit(object, X_WO, finding)) {
    finding.verdict = PoseVerdict::kElsewhere;
  } else if (known && known->finding.verdict == PoseVerdict::kElsewhere) {
    known->rest = kRest;  // it still stands there, and nowhere better
    return keep();
  } else {
    finding = counted;
    if (through >= kSeenThrough * judged) {
      finding.verdict = PoseVerdict::kGone;
    } else if (through >= kDisagree * judged) {
      finding.verdict = PoseVerdict::kUnclear;
    }  // otherwise it agrees, or something stands before it: unseen
  }
  known = Known{X_WO, finding, kRest};
}

std::vector<PoseFinding> PoseCheck::judge(const fusion::DepthImage& image, std::span<const float> arm_depth_m,
                                          std::span<const Place> X_WO) {
  image_ = &image;
  arm_depth_m_ = arm_depth_m;
  places_ = X_WO;
  drawn_.assign(image.camera().pixels(), {});
  for (std::size_t i = 0; i < objects_.size(); ++i)
    if (X_WO[i]) draw(i, *X_WO[i], drawn_);
  std::vector<Count> counts;
  count(drawn_, counts);
  std::vector<PoseFinding> findings;
  int fits = kMaxFits;
  const std::size_t first = first_;
  for (std::size_t k = 0; k < objects_.size(); ++k) {
    const std::size_t i = (first + k) % objects_.size();
    if (!X_WO[i]) continue;
    PoseFinding finding{.id = objects_[i].id,
                        .name = objects_[i].name,
                        .X_WO = *X_WO[i],
                        .corrected_WO = *X_WO[i],
                        .open = {}};
    const Count& seen = counts[i];
    const auto judged = static_cast<double>(seen.judged());
    finding.pixels = seen.judged();
    finding.agree = seen.agree;
    finding.through = seen.through;
    if (seen.judged() < kMinPixels) {
      findings.push_back(std::move(finding));
      continue;
    }
    const bool agrees = static_cast<double>(seen.agree) >= (1.0 - kDisagree) * judged;
    if (agrees) finding.verdict = PoseVerdict::kAgrees;
    if (agrees && !seems_moved(seen)) {
      known_[i].reset();
    } else {
      find(i, *X_WO[i], seen, fits, finding);
    }
    findings.push_back(std::move(finding));
  }
  return findings;
}

}  // namespace phantom::workspace_camera
