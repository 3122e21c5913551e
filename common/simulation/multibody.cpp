#include "common/simulation/multibody.hpp"

#include <mujoco/mujoco.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>
#include <sstream>
#include <stdexcept>

namespace phantom::simulation {
namespace {

using RowMatrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Share of what pushes two bodies together that a contact takes away at once, before its spring is pressed:
// next to nothing, so that spring and damper are as stated.
constexpr double kImpedance = 0.005;
// Share of its slip that a contact within its friction loses in a step.
constexpr double kSlipLost = 0.5;
// Friction and limits of joints: as hard as the solver allows, so that a joint at rest creeps by less than 1
// nm/s.
constexpr double kHard = 0.9999;

class Words {
 public:
  Words() { text_.precision(17); }
  Words& operator<<(const Eigen::Vector3d& v) {
    text_ << v.x() << ' ' << v.y() << ' ' << v.z();
    return *this;
  }
  template <class T>
  Words& operator<<(const T& t) {
    text_ << t;
    return *this;
  }
  Words& pose(const geometry::Pose& X) {
    const Eigen::Vector4d q = geometry::quaternion_xyzw(X.rotation);
    return *this << "pos='" << X.translation_m << "' quat='" << q[3] << ' ' << q[0] << ' ' << q[1] << ' '
                 << q[2] << "'";
  }
  std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
};

// What every body has. Masses are set later, as the compiler would refuse inertias of points; here their
// frame only shows that it is not the body's, of which the compiler makes use otherwise. The sphere touches
// nothing; it says whose contact one is.
constexpr const char* kBody =
    "<inertial pos='0.1 0.2 0.3' quat='1 2 3 4' mass='1' diaginertia='1 2 2.5'/><geom type='sphere' size='0.001' contype='0' conaffinity='0'/>";

void open_slide(Words& xml, const char* type, const Eigen::Vector3d& axis, const JointMechanics& joint) {
  xml << "<joint type='" << type << "' axis='" << axis << "'";
  if (std::isfinite(joint.lower) && std::isfinite(joint.upper) && joint.upper < 1e8)
    xml << " limited='true' range='" << joint.lower << ' ' << std::max(joint.upper, joint.lower + 1e-9)
        << "'";
  xml << "/>";
}

std::string model_text(const robot::SerialArm& arm, const ArmMechanics& joints,
                       std::span<const LooseBody> loose, double sub_step_s) {
  const std::size_t rows = 3 * Multibody::kMaxContacts + 4 * core::kMaxJoints;
  Words xml;
  xml << "<mujoco><compiler angle='radian' boundmass='1e-9' boundinertia='1e-12'/><size njmax='" << rows
      << "' nconmax='" << Multibody::kMaxContacts << "'/><option timestep='" << sub_step_s
      << "' gravity='0 0 0' cone='elliptic' impratio='1e-5' iterations='30' tolerance='1e-10' noslip_iterations='10' noslip_tolerance='1e-12'/>"
      << "<worldbody><geom type='sphere' size='0.001' contype='0' conaffinity='0'/>";
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const robot::Joint& joint = arm.joints()[j];
    xml << "<body ";
    xml.pose(j == 0 ? arm.base_pose() * joint.X_parent_joint : joint.X_parent_joint) << ">" << kBody;
    open_slide(xml, joint.type == robot::JointType::kRevolute ? "hinge" : "slide", joint.axis, joints[j]);
  }
  for (std::size_t j = 0; j < arm.joint_count(); ++j) xml << "</body>";
  for (const LooseBody& body : loose) {
    xml << "<body ";
    xml.pose(body.X_WO) << "><freejoint/>" << kBody << "</body>";
  }
  xml << "</worldbody></mujoco>";
  return xml.text();
}

mjModel* compile(const std::string& xml) {
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), "world.xml", static_cast<int>(xml.size()));
  std::memcpy(files->filedata[0], xml.data(), xml.size());
  std::array<char, 1000> problem{};
  mjModel* model = mj_loadXML("world.xml", files.get(), problem.data(), problem.size());
  mj_deleteVFS(files.get());
  if (model == nullptr) throw std::runtime_error(std::string("simulated world: ") + problem.data());
  return model;
}

void set_mass(mjModel& m, std::size_t body, double mass_kg, const Eigen::Vector3d& centre_m,
              const Eigen::Matrix3d& inertia_kg_m2) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertia_kg_m2);
  Eigen::Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0.0) axes.col(0) *= -1.0;
  const Eigen::Vector4d q = geometry::quaternion_xyzw(axes);
  m.body_mass[body] = std::max(mass_kg, 1e-9);
  for (int i = 0; i < 3; ++i) {
    m.body_ipos[3 * body + static_cast<std::size_t>(i)] = centre_m[i];
    m.body_inertia[3 * body + static_cast<std::size_t>(i)] = std::max(solver.eigenvalues()[i], 1e-12);
  }
  mju_copy4(&m.body_iquat[4 * body], std::array{q[3], q[0], q[1], q[2]}.data());
}

void set_joint(mjModel& m, std::size_t dof, const JointMechanics& joint, double inertia) {
  m.dof_armature[dof] = inertia;
  m.dof_damping[dof] = joint.viscous;
  m.dof_frictionloss[dof] = joint.coulomb;
  const double lag_s = 2.0 * m.opt.timestep;
  for (mjtNum* solref : {&m.dof_solref[mjNREF * dof], &m.jnt_solref[mjNREF * dof]}) {
    solref[0] = lag_s;
    solref[1] = 1.0;
  }
  for (mjtNum* solimp : {&m.dof_solimp[mjNIMP * dof], &m.jnt_solimp[mjNIMP * dof]})
    solimp[0] = solimp[1] = kHard;
}

// MuJoCo's problem has a solution at once because sliding contacts are lifted off: at 0.5 m/s by a
// millimetre, and blocks hop. So friction has next to no weight in it (impratio), and is found after the
// normal forces, from them and by Coulomb's law (its noslip iterations), with a damping of its own.
void make_constraints(const mjModel* m, mjData* d) {
  mj_makeConstraint(m, d);
  for (int i = 0; i < d->ncon; ++i) {
    const int row = d->contact[i].efc_address;
    if (row < 0) continue;
    for (const int tangent : {row + 1, row + 2}) d->efc_KBIP[4 * tangent + 1] = kSlipLost / m->opt.timestep;
  }
}

void no_warning(const char*) {}
void give_up(const char* problem) { throw std::runtime_error(std::string("MuJoCo: ") + problem); }

}  // namespace

struct Multibody::World {
  explicit World(mjModel* compiled) : m(compiled), d(mj_makeData(compiled)) {}
  ~World() {
    mj_deleteData(d);
    mj_deleteModel(m);
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  // Everything that depends on positions alone, without contacts.
  void take_positions() {
    mj_kinematics(m, d);
    mj_comPos(m, d);
    mj_crb(m, d);
    mj_factorM(m, d);
    mj_collision(m, d);
  }
  mjModel* m;
  mjData* d;
  std::vector<mjtNum> last_qpos;
};

Multibody::Multibody(const robot::SerialArm& arm, const ArmMechanics& joints, const core::JointArray& rotor,
                     const core::JointArray& start_q, const robot::Payload& payload,
                     std::span<const LooseBody> loose, double sub_step_s)
    : joint_count_(arm.joint_count()), loose_(loose.begin(), loose.end()), rests_(loose.size(), 0) {
  static std::once_flag once;
  std::call_once(once, [] {
    mju_user_warning = no_warning;
    mju_user_error = give_up;
  });
  world_ = std::make_unique<World>(compile(model_text(arm, joints, loose, sub_step_s)));
  mjModel& m = *world_->m;
  carry(arm, payload);
  for (std::size_t j = 0; j < joint_count_; ++j) set_joint(m, j, joints[j], rotor[j]);
  for (std::size_t i = 0; i < loose_.size(); ++i)
    set_mass(m, first_loose() + i, loose[i].mass_kg, loose[i].centre_of_mass_m, loose[i].inertia_kg_m2);
  mj_setConst(&m, world_->d);
  mj_resetData(&m, world_->d);
  std::copy_n(start_q.begin(), joint_count_, world_->d->qpos);
  world_->take_positions();
  world_->last_qpos.assign(world_->d->qpos, world_->d->qpos + m.nq);
}

Multibody::~Multibody() = default;

void Multibody::carry(const robot::SerialArm& arm, const robot::Payload& payload) noexcept {
  for (std::size_t j = 1; j <= joint_count_; ++j) {
    const robot::Link& link = arm.links()[j];
    const robot::LoadBody& load = payload.on_link[j];
    robot::Link loaded;
    loaded.mass_kg = link.mass_kg;
    loaded.centre_of_mass_m = link.centre_of_mass_m;
    loaded.inertia_kg_m2 = link.inertia_kg_m2;
    if (load.mass_kg > 0.0) loaded.add_body(load.mass_kg, load.centre(), load.inertia());
    set_mass(*world_->m, j, loaded.mass_kg, loaded.centre_of_mass_m, loaded.inertia_kg_m2);
  }
  world_->take_positions();
}

void Multibody::forces(const core::JointArray& torque_Nm) noexcept {
  mjData& d = *world_->d;
  for (std::size_t j = 0; j < joint_count_; ++j) d.qfrc_applied[j] = torque_Nm[j];
  for (std::size_t i = 0; i < loose_.size(); ++i) {
    d.xfrc_applied[6 * (first_loose() + i) + 2] = rests_[i] ? 0.0 : -loose_[i].mass_kg * robot::kGravity_m_s2;
    if (rests_[i]) mju_zero(d.qvel + joint_count_ + 6 * i, 6);
  }
}

// With the forces of the step's end, f − K(q + h v⁺ − q0) − D v⁺, in place of its beginning: (M + h D + h² K)
// a = f − K(q + h v − q0) − D v + all else. A serial arm's mass matrix has a place for every pair of joints.
void Multibody::yield(const JointYield& yields) noexcept {
  if (!yields.some) return;
  const mjModel& m = *world_->m;
  mjData& d = *world_->d;
  const double h = m.opt.timestep;
  for (std::size_t i = 0; i < joint_count_; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    d.qfrc_applied[i] += yields.at_rest[i];
    for (std::size_t k = 0; k < joint_count_; ++k) {
      const double stiffness = yields.stiffness(row, static_cast<Eigen::Index>(k)),
                   damping = yields.damping(row, static_cast<Eigen::Index>(k));
      d.qfrc_applied[i] -= stiffness * (d.qpos[k] + h * d.qvel[k] - yields.q0[k]) + damping * d.qvel[k];
      if (k <= i) d.qM[static_cast<std::size_t>(m.dof_Madr[i]) + i - k] += h * (damping + h * stiffness);
    }
  }
  mj_factorM(&m, &d);
}

void Multibody::add(const Contact& contact) noexcept {
  const mjModel& m = *world_->m;
  mjContact c{};
  c.dist = -contact.depth_m;
  for (int i = 0; i < 3; ++i) c.pos[i] = contact.point_W_m[i];
  const Eigen::Vector3d side = contact.normal_W.unitOrthogonal();
  RowMatrix3 frame;
  frame << contact.normal_W.transpose(), side.transpose(), contact.normal_W.cross(side).transpose();
  mju_copy(c.frame, frame.data(), 9);
  c.friction[0] = c.friction[1] = std::max(contact.friction, 1e-5);
  c.friction[2] = c.friction[3] = c.friction[4] = 1e-5;
  c.solimp[0] = c.solimp[1] = kImpedance;
  c.solimp[2] = 0.001, c.solimp[3] = 0.5, c.solimp[4] = 2.0;
  // With MuJoCo's R = (1 − d)/d · w, the spring and the damper that a force F presses by F/K at rest. Light
  // bodies get softer ones: an explicit step of a spring bears no more.
  const double w = m.body_invweight0[2 * contact.a] + m.body_invweight0[2 * contact.b];
  const double h = m.opt.timestep;
  c.solref[0] = -std::min(contact.stiffness_N_per_m * (1.0 - kImpedance) * w, 0.1 / (h * h));
  c.solref[1] = -std::min(contact.damping_Ns_per_m * (1.0 - kImpedance) * w, 0.3 / h);
  c.dim = 3;
  c.geom1 = static_cast<int>(contact.b);
  c.geom2 = static_cast<int>(contact.a);
  c.efc_address = -1;
  mj_addContact(&m, world_->d, &c);
}

// MuJoCo takes bodies' surfaces to move with them. So the damper and the friction of one that does not get
// the rest of its velocity here.
void Multibody::move_surfaces(std::span<const Contact> contacts) noexcept {
  mjData& d = *world_->d;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const int row = d.contact[i].efc_address;
    if (row < 0) continue;
    const Eigen::Vector3d along =
        Eigen::Map<const RowMatrix3>(d.contact[i].frame) * contacts[i].surface_W_m_s;
    for (int k = 0; k < 3; ++k) d.efc_aref[row + k] -= d.efc_KBIP[4 * (row + k) + 1] * along[k];
  }
}

void Multibody::advance(const core::JointArray& torque_Nm, std::span<Contact> contacts,
                        const JointYield& yields) noexcept {
  mjModel* m = world_->m;
  mjData* d = world_->d;
  const std::size_t count = std::min(contacts.size(), kMaxContacts);
  for (std::size_t i = 0; i < count; ++i) add(contacts[i]);
  forces(torque_Nm);
  yield(yields);
  make_constraints(m, d);
  mj_transmission(m, d);
  mj_projectConstraint(m, d);
  mj_fwdVelocity(m, d);
  move_surfaces(contacts.first(count));
  mj_fwdActuation(m, d);
  mj_fwdAcceleration(m, d);
  mj_fwdConstraint(m, d);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    contacts[i].force_W_N.setZero();
    if (i >= count) continue;
    std::array<mjtNum, 6> force{};
    mj_contactForce(m, d, static_cast<int>(i), force.data());
    contacts[i].force_W_N = Eigen::Map<const RowMatrix3>(d->contact[i].frame).transpose() *
                            Eigen::Map<const Eigen::Vector3d>(force.data());
  }
  mj_Euler(m, d);
  keep_finite();
  world_->take_positions();
}

void Multibody::keep_finite() noexcept {
  mjModel* m = world_->m;
  mjData* d = world_->d;
  double sum = 0.0;
  for (int i = 0; i < m->nq; ++i) sum += d->qpos[i];
  for (int i = 0; i < m->nv; ++i) sum += d->qvel[i];
  if (std::abs(sum) < 1e12) {
    mju_copy(world_->last_qpos.data(), d->qpos, m->nq);
    return;
  }
  mju_copy(d->qpos, world_->last_qpos.data(), m->nq);
  mju_zero(d->qvel, m->nv);
  mju_zero(d->qacc_warmstart, m->nv);
}

void Multibody::set_sub_step(double sub_step_s) noexcept {
  mjModel& m = *world_->m;
  if (m.opt.timestep == sub_step_s) return;
  m.opt.timestep = sub_step_s;
  for (std::size_t dof = 0; dof < joint_count_; ++dof)
    m.dof_solref[mjNREF * dof] = m.jnt_solref[mjNREF * dof] = 2.0 * sub_step_s;
}

double Multibody::q(std::size_t joint) const noexcept { return world_->d->qpos[joint]; }
double Multibody::v(std::size_t joint) const noexcept { return world_->d->qvel[joint]; }

double Multibody::speed(std::size_t loose) const noexcept {
  const double* v = world_->d->qvel + joint_count_ + 6 * loose;
  return Eigen::Map<const Eigen::Vector3d>(v).norm() + 0.1 * Eigen::Map<const Eigen::Vector3d>(v + 3).norm();
}

geometry::Pose Multibody::pose(std::size_t body) const noexcept {
  return {Eigen::Map<const RowMatrix3>(world_->d->xmat + 9 * body),
          Eigen::Map<const Eigen::Vector3d>(world_->d->xpos + 3 * body)};
}

double Multibody::kinetic_J() const {
  const mjData& d = *world_->d;
  Eigen::VectorXd momentum(world_->m->nv);
  mj_mulM(world_->m, &d, momentum.data(), d.qvel);
  return 0.5 * momentum.dot(Eigen::Map<const Eigen::VectorXd>(d.qvel, world_->m->nv));
}

}  // namespace phantom::simulation
