// Reads a serial chain from a URDF file. No file but this and urdf_*.cpp uses urdfdom.
#include <urdf_parser/urdf_parser.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/core/text.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/robot/kinematics/internal/urdf_file.hpp"
#include "common/robot/kinematics/internal/urdf_joints.hpp"
#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::robot {
namespace {

using detail::is_moving;
using detail::text_of;
using detail::UrdfFault;

geometry::Pose pose_of(const urdf::Pose& pose) {
  return {geometry::rotation_from_quaternion(
              {pose.rotation.x, pose.rotation.y, pose.rotation.z, pose.rotation.w}),
          {pose.position.x, pose.position.y, pose.position.z}};
}

bool finite(const geometry::Pose& pose) {
  return pose.rotation.allFinite() && pose.translation_m.allFinite();
}

/// What is read beside the chain itself.
struct Reading {
  std::filesystem::path folder;  // the URDF's
  detail::HeldJoints held;
  std::vector<std::string> notices = {};
  std::size_t moved = 0;         // meshes of packages that are taken from elsewhere
  std::string first_moved = {};  // the first, in a sentence
};

/// Adds which moving links have no mass.
void note_mass(const std::vector<Link>& links, std::vector<std::string>& notices) {
  std::string without;
  bool all = true;
  for (std::size_t i = 1; i < links.size(); ++i) {
    if (links[i].mass_kg > 0.0) {
      all = false;
    } else {
      core::add_to_list(without, "'" + links[i].name + "'");
    }
  }
  if (all) {
    notices.emplace_back(
        "no moving link has a mass (<inertial>): the arm's weight and inertia are not known");
  } else if (!without.empty()) {
    notices.push_back("links without mass (<inertial>): " + without);
  }
}

constexpr double kMaxLength_m = 1e4;  // as of a cell's shapes

/// Returns the mesh of a box, a cylinder or a sphere; without triangles if one of its lengths is 0.
geometry::TriangleMesh body_of(const urdf::Geometry& shape, const std::string& place) {
  const auto lengths = [&](std::initializer_list<double> all) {
    for (const double length : all) {
      if (!(length >= 0.0 && length <= kMaxLength_m))
        throw UrdfFault{place + ": lengths of its geometry must be from 0 to " + text_of(kMaxLength_m) +
                        " m"};
    }
    return std::min(all) > 0.0;
  };
  if (shape.type == urdf::Geometry::BOX) {
    const urdf::Vector3& size = static_cast<const urdf::Box&>(shape).dim;
    if (lengths({size.x, size.y, size.z})) return geometry::make_box({size.x, size.y, size.z});
  } else if (shape.type == urdf::Geometry::CYLINDER) {
    const auto& cylinder = static_cast<const urdf::Cylinder&>(shape);
    if (lengths({cylinder.radius, cylinder.length}))
      return geometry::make_cylinder(cylinder.radius, cylinder.length);
  } else if (lengths({static_cast<const urdf::Sphere&>(shape).radius})) {
    return geometry::make_sphere(static_cast<const urdf::Sphere&>(shape).radius);
  }
  return {};
}

/// Returns what is odd about the name of a mesh file that is missing, for the end of a message.
std::string about_mesh_name(const std::string& name) {
  if (name.find("$(") != std::string::npos || name.find("${") != std::string::npos)
    return "; it holds xacro that has not been expanded: needed is what xacro makes of the URDF";
  if (name.find('\\') != std::string::npos) return "; it has '\\' where a URDF has '/'";
  const std::size_t scheme = name.find("://");
  if (scheme != std::string::npos && !is_of_package(name) && !name.starts_with("file://"))
    return "; '" + name.substr(0, scheme) + "' is not read: allowed are package://, file:// and plain paths";
  return {};
}

/// Adds a piece of geometry of the URDF link `name`, at `X_link_piece` in the moving link.
void add_mesh(const urdf::Geometry& shape, const geometry::Pose& X_link_piece, const urdf::Material* material,
              const std::string& name, Reading& reading, Link& link) {
  const std::string place = "link '" + name + "'";
  if (!finite(X_link_piece)) throw UrdfFault{place + ": origin of its geometry must be finite numbers"};
  LinkMesh result;
  if (shape.type == urdf::Geometry::MESH) {
    const auto& mesh = static_cast<const urdf::Mesh&>(shape);
    result.file = find_mesh(reading.folder, mesh.filename);
    if (!std::filesystem::is_regular_file(result.file)) {
      throw UrdfFault{place + ": mesh '" + mesh.filename + "' is missing (looked for " +
                          result.file.string() +
                          (is_of_package(mesh.filename) ? " and in the folders above" : "") + ")" +
                          about_mesh_name(mesh.filename),
                      true};
    }
    if (is_of_package(mesh.filename) && !lies_in_package(result.file, mesh.filename) && reading.moved++ == 0)
      reading.first_moved = place + ": " + mesh.filename + " is taken from " + result.file.string();
    result.scale = {mesh.scale.x, mesh.scale.y, mesh.scale.z};
    if (!result.scale.allFinite() || !(result.scale.cwiseAbs().minCoeff() > 0.0))
      throw UrdfFault{place + ": mesh '" + mesh.filename +
                      "': scale must be three finite numbers, none of them 0"};
  } else {
    result.body = body_of(shape, place);
    if (result.body.triangles.empty()) {
      reading.notices.push_back(place + ": geometry with a length of 0 is left out");
      return;
    }
  }
  result.X_link_mesh = X_link_piece;
  if (material != nullptr) result.colour = {material->color.r, material->color.g, material->color.b};
  link.meshes.push_back(std::move(result));
}

/// Adds what is seen of a URDF link: its visuals or, if it has none, its collision geometry.
void add_meshes(const urdf::Link& source, const geometry::Pose& X_link_frame, Reading& reading, Link& link) {
  for (const auto& visual : source.visual_array) {
    add_mesh(*visual->geometry, X_link_frame * pose_of(visual->origin), visual->material.get(), source.name,
             reading, link);
  }
  if (!source.visual_array.empty() || source.collision_array.empty()) return;
  reading.notices.push_back("link '" + source.name + "' has no visual; its collision geometry stands for it");
  for (const auto& collision : source.collision_array) {
    add_mesh(*collision->geometry, X_link_frame * pose_of(collision->origin), nullptr, source.name, reading,
             link);
  }
}

constexpr double kRoundedInertia = 0.01;  // files give inertias with few digits
constexpr double kMaxGyration_m = 5.0;    // no link of a manipulator is larger

Eigen::Vector3d principal_moments(const Eigen::Matrix3d& inertia_kg_m2) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia_kg_m2, Eigen::EigenvaluesOnly).eigenvalues();
}

/// Returns the inertia about the centre of mass, along the axes of the <inertial>'s frame.
Eigen::Matrix3d inertia_of(const urdf::Inertial& body, const std::string& link,
                           std::vector<std::string>& notices) {
  Eigen::Matrix3d inertia;
  inertia << body.ixx, body.ixy, body.ixz, body.ixy, body.iyy, body.iyz, body.ixz, body.iyz, body.izz;
  if (!is_inertia(inertia))
    throw UrdfFault{"link '" + link + "': inertia must be finite, with no principal moment below 0"};
  const Eigen::Vector3d principal = principal_moments(inertia);
  const double greatest = principal.maxCoeff(), others = principal.sum() - greatest;
  const std::string moments =
      core::listed(principal, [](double moment) { return text_of(moment); }) + " kg·m²";
  if (greatest > others * (1.0 + kRoundedInertia)) {
    notices.push_back("link '" + link + "': no body has its inertia, of the principal moments " + moments +
                      ": the greatest may not exceed the sum of the others");
  }
  const double gyration_m = std::sqrt(greatest / body.mass);
  if (gyration_m > kMaxGyration_m) {
    notices.push_back("link '" + link + "': its inertia, " + moments + ", is that of a body with its " +
                      text_of(body.mass) + " kg " + text_of(gyration_m) +
                      " m from its middle: a URDF is in kg and m");
  }
  return inertia;
}

/// Adds a URDF link, at `X_link_frame` in the moving link `link`.
void absorb_one(const urdf::Link& source, const geometry::Pose& X_link_frame, Reading& reading, Link& link) {
  link.frames.emplace_back(source.name, X_link_frame);
  add_meshes(source, X_link_frame, reading, link);
  if (!source.inertial) return;
  const double mass = source.inertial->mass;
  if (!(mass >= 0.0) || !std::isfinite(mass))
    throw UrdfFault{"link '" + source.name + "': mass must be 0 or above"};
  if (!(mass > 0.0)) return;
  const geometry::Pose X_link_body = X_link_frame * pose_of(source.inertial->origin);
  const Eigen::Matrix3d& R = X_link_body.rotation;
  const Eigen::Matrix3d inertia = inertia_of(*source.inertial, source.name, reading.notices);
  link.add_body(mass, X_link_body.translation_m, R * inertia * R.transpose());
}

/// Adds the URDF link that the moving link `link` is named after, and everything that is fixed to it or held,
/// depth first; a branch may be of any depth.
void absorb(const urdf::ModelInterface& model, const urdf::Link& carried, const std::string& next_in_chain,
            Reading& reading, Link& link) {
  struct Branch {
    const urdf::Joint* joint;
    geometry::Pose X_link_parent;
  };
  std::vector<Branch> open;
  const auto add = [&](const urdf::Link& source, const geometry::Pose& X_link_frame) {
    absorb_one(source, X_link_frame, reading, link);
    for (auto joint = source.child_joints.rbegin(); joint != source.child_joints.rend(); ++joint)
      if ((*joint)->name != next_in_chain) open.push_back({joint->get(), X_link_frame});
  };
  add(carried, {});
  while (!open.empty()) {
    const auto [joint, X_link_parent] = open.back();
    open.pop_back();
    const geometry::Pose X_parent_child =
        pose_of(joint->parent_to_joint_origin_transform) * reading.held.motion(*joint);
    if (!finite(X_parent_child))
      throw UrdfFault{"joint '" + joint->name + "': origin must be finite numbers"};
    add(*model.getLink(joint->child_link_name), X_link_parent * X_parent_child);
  }
}

}  // namespace

core::Expected<SerialArm> SerialArm::from_urdf(const std::filesystem::path& urdf, const std::string& tip_link,
                                               const geometry::Pose& X_WB,
                                               const std::map<std::string, double>& held,
                                               const JointLimits& limits) {
  try {
    const urdf::ModelInterfaceSharedPtr model = detail::read_urdf_file(urdf);
    std::vector<urdf::JointSharedPtr> chain = detail::chain_to(*model, tip_link);
    const auto moving = static_cast<std::size_t>(
        std::count_if(chain.begin(), chain.end(), [](const auto& joint) { return is_moving(*joint); }));
    if (moving == 0)
      throw UrdfFault{"no joint moves between the root and tip link '" + tip_link +
                      "'; at least one is needed"};
    if (moving > core::kMaxJoints) {
      throw UrdfFault{"has " + std::to_string(moving) + " moving joints up to '" + tip_link + "'; at most " +
                      std::to_string(core::kMaxJoints) + " are allowed"};
    }

    detail::check_stated_limits(limits, chain);

    Reading reading{urdf.parent_path(), detail::HeldJoints(*model, chain, held)};
    SerialArm arm;
    arm.X_WB_ = X_WB;
    // URDF link whose frame is the current moving link's.
    urdf::LinkConstSharedPtr carried = model->getRoot();
    geometry::Pose X_link_frame;  // pose of the chain's latest URDF link in the current moving link
    for (std::size_t i = 0; i <= chain.size(); ++i) {
      // Follow the chain's fixed joints; absorb() makes what they carry part of the link.
      if (i < chain.size()) {
        const geometry::Pose X_frame_joint = pose_of(chain[i]->parent_to_joint_origin_transform);
        if (!finite(X_frame_joint))
          throw UrdfFault{"joint '" + chain[i]->name + "': origin must be finite numbers"};
        X_link_frame = X_link_frame * X_frame_joint;
        if (!is_moving(*chain[i])) continue;
      }
      Link link;
      link.name = carried->name;
      absorb(*model, *carried, i < chain.size() ? chain[i]->name : std::string(), reading, link);
      arm.links_.push_back(std::move(link));
      if (i == chain.size()) break;
      arm.joints_.push_back(detail::joint_of(*chain[i], limits));
      detail::note_limits(*chain[i], arm.joints_.back(), reading.notices);
      arm.joints_.back().X_parent_joint = X_link_frame;
      carried = model->getLink(chain[i]->child_link_name);
      X_link_frame = {};
    }
    arm.notices_ = std::move(reading.notices);
    if (reading.moved > 1)
      reading.first_moved += "; so are " + std::to_string(reading.moved - 1) + " more meshes of packages";
    if (reading.moved > 0) arm.notices_.push_back(reading.first_moved);
    note_mass(arm.links_, arm.notices_);
    if (!reading.held.notice().empty()) arm.notices_.push_back(reading.held.notice());
    arm.tip_m_ = arm.find_frame(tip_link)->second.translation_m;
    return arm;
  } catch (const UrdfFault& fault) {
    const std::string message = urdf.string() + ": " + fault.what;
    return fault.missing ? core::Status::not_found(message) : core::Status::invalid_argument(message);
  }
}

}  // namespace phantom::robot
