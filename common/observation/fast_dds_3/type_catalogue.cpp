#include "common/observation/type_catalogue.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/xtypes/dynamic_types/DynamicType.hpp>
#include <fastdds/dds/xtypes/dynamic_types/DynamicTypeBuilder.hpp>
#include <fastdds/dds/xtypes/dynamic_types/DynamicTypeBuilderFactory.hpp>
#include <fastdds/dds/xtypes/dynamic_types/DynamicTypeMember.hpp>
#include <fastdds/dds/xtypes/dynamic_types/MemberDescriptor.hpp>
#include <fastdds/dds/xtypes/dynamic_types/TypeDescriptor.hpp>
#include <fastdds/dds/xtypes/type_representation/ITypeObjectRegistry.hpp>
#include <map>
#include <mutex>
#include <stdexcept>

#include "common/dds/endpoints/topic_list.hpp"
#include "common/observation/learn_type.hpp"
#include "fast_dds/types.hpp"
#include "phantom_idl_types/haptic_deviceTypeObjectSupport.hpp"
#include "phantom_idl_types/perceptTypeObjectSupport.hpp"
#include "phantom_idl_types/statusTypeObjectSupport.hpp"
#include "phantom_idl_types/teleoperationTypeObjectSupport.hpp"
#include "phantom_idl_types/workspaceTypeObjectSupport.hpp"

namespace phantom::observation {
namespace {

namespace edds = eprosima::fastdds::dds;
using diagnostics::Kind;
using diagnostics::Type;
using diagnostics::TypePtr;
using DynamicType = edds::DynamicType::_ref_type;

const std::map<edds::TypeKind, Kind> kPrimitives{
    {edds::TK_BOOLEAN, Kind::kBoolean}, {edds::TK_BYTE, Kind::kOctet},
    {edds::TK_UINT8, Kind::kOctet},     {edds::TK_CHAR8, Kind::kChar},
    {edds::TK_INT16, Kind::kInt16},     {edds::TK_UINT16, Kind::kUint16},
    {edds::TK_INT32, Kind::kInt32},     {edds::TK_UINT32, Kind::kUint32},
    {edds::TK_INT64, Kind::kInt64},     {edds::TK_UINT64, Kind::kUint64},
    {edds::TK_FLOAT32, Kind::kFloat32}, {edds::TK_FLOAT64, Kind::kFloat64}};

edds::TypeDescriptor::_ref_type descriptor_of(const DynamicType& dynamic) {
  auto descriptor = edds::traits<edds::TypeDescriptor>::make_shared();
  if (!fast_dds::ok(dynamic->get_descriptor(descriptor)))
    throw std::logic_error(std::string(dynamic->get_name()) + ": a type without a description");
  return descriptor;
}

/// Reads one type as a tree. Its limits are those of learn_type().
class Description {
 public:
  /// `depth`: types around this one; `elements`: how often arrays around it repeat it.
  TypePtr of(const DynamicType& dynamic, int depth = 0, std::uint64_t elements = 1) {
    if (!dynamic) throw std::logic_error("a member without a type");
    if (depth > kDeepest || ++members_ > kMaxMembers)
      throw std::logic_error("more than 4,096 members, or 32 levels of types");
    const edds::TypeKind kind = dynamic->get_kind();
    if (const auto primitive = kPrimitives.find(kind); primitive != kPrimitives.end())
      return std::make_shared<Type>(Type{.kind = primitive->second});
    const auto descriptor = descriptor_of(dynamic);
    Type type;
    switch (kind) {
      case edds::TK_ALIAS:
        return of(descriptor->base_type(), depth + 1, elements);
      case edds::TK_ARRAY:
        return array_of(*descriptor, depth, elements);
      case edds::TK_STRING8:
      case edds::TK_SEQUENCE:
        type.kind = kind == edds::TK_SEQUENCE ? Kind::kSequence : Kind::kString;
        type.bound = descriptor->bound().at(0);
        if (type.bound == static_cast<std::uint32_t>(edds::LENGTH_UNLIMITED)) type.bound = 0;
        if (kind == edds::TK_SEQUENCE) type.element = of(descriptor->element_type(), depth + 1, elements);
        break;
      case edds::TK_ENUM:
      case edds::TK_STRUCTURE:
        type.kind = kind == edds::TK_ENUM ? Kind::kEnum : Kind::kStruct;
        type.name = std::string(dynamic->get_name());
        add_members(dynamic, type, depth, elements);
        break;
      default:
        throw std::logic_error(std::string(dynamic->get_name()) + ": a kind of type that is not decoded");
    }
    return std::make_shared<Type>(std::move(type));
  }

 private:
  static constexpr int kDeepest = 32;
  static constexpr std::size_t kMaxMembers = 4096;
  static constexpr std::uint64_t kMaxElements = 1U << 24U;

  // double x[2][3] is an array of two arrays of three.
  TypePtr array_of(const edds::TypeDescriptor& descriptor, int depth, std::uint64_t elements) {
    for (const std::uint64_t bound : descriptor.bound()) {
      if (bound == 0 || bound > kMaxElements / elements)
        throw std::logic_error("arrays of no element, or of more than 2^24");
      elements *= bound;
    }
    TypePtr inner = of(descriptor.element_type(), depth + 1, elements);
    for (auto bound = descriptor.bound().rbegin(); bound != descriptor.bound().rend(); ++bound) {
      Type array{.kind = Kind::kArray, .element = inner, .bound = *bound};
      inner = std::make_shared<Type>(std::move(array));
    }
    return inner;
  }

  void add_members(const DynamicType& dynamic, Type& type, int depth, std::uint64_t elements) {
    const auto base = descriptor_of(dynamic)->base_type();
    if (base && type.kind == Kind::kStruct) {
      if (depth > kDeepest || base->get_kind() != edds::TK_STRUCTURE)
        throw std::logic_error(type.name + ": a base that is not decoded");
      Type inherited{.kind = Kind::kStruct, .name = type.name};
      add_members(base, inherited, depth + 1, elements);
      type.members = std::move(inherited.members);
    }
    for (std::uint32_t i = 0; i < dynamic->get_member_count(); ++i) {
      edds::DynamicTypeMember::_ref_type member;
      auto descriptor = edds::traits<edds::MemberDescriptor>::make_shared();
      if (!fast_dds::ok(dynamic->get_member_by_index(member, i)) ||
          !fast_dds::ok(member->get_descriptor(descriptor)))
        throw std::logic_error(type.name + ": a member without a description");
      const std::string name = checked(std::string(member->get_name()));
      if (type.kind == Kind::kEnum) {
        if (++members_ > kMaxMembers) throw std::logic_error(type.name + ": more than 4,096 members");
        type.literals.push_back({name, static_cast<std::uint32_t>(std::stoul(descriptor->default_value()))});
      } else {
        if (descriptor->is_optional())
          throw std::logic_error(type.name + ": optional members are not decoded");
        type.members.push_back({name, of(descriptor->type(), depth + 1, elements), descriptor->is_key()});
      }
    }
    // What takes no octet could be there any number of times.
    if (type.members.empty() && type.literals.empty()) throw std::logic_error(type.name + ": no members");
  }

  static std::string checked(std::string name) {
    const bool is_identifier =
        !name.empty() && name.size() <= 256 && std::all_of(name.begin(), name.end(), [](char c) {
          return c == '_' || std::isalnum(static_cast<unsigned char>(c)) != 0;
        });
    if (!is_identifier) throw std::logic_error("a member whose name is none of IDL");
    return name;
  }

  std::size_t members_ = 0;
};

// Each registers the types that it uses, too.
void register_topics() {
  edds::xtypes::TypeIdentifierPair ids;
  msg::register_MasterState_type_identifier(ids);
  msg::register_SlaveState_type_identifier(ids);
  msg::register_GripperState_type_identifier(ids);
  msg::register_DragField_type_identifier(ids);
  msg::register_Percept_type_identifier(ids);
  msg::register_InterestPoints_type_identifier(ids);
  msg::register_SkinPercept_type_identifier(ids);
  msg::register_HitAlert_type_identifier(ids);
  msg::register_ModelDoubt_type_identifier(ids);
  msg::register_SensingCommand_type_identifier(ids);
  msg::register_SensingReply_type_identifier(ids);
  msg::register_OperatorCommand_type_identifier(ids);
  msg::register_OperatorReply_type_identifier(ids);
  msg::register_ViewPose_type_identifier(ids);
  msg::register_WristWrench_type_identifier(ids);
  msg::register_ViewPicture_type_identifier(ids);
  msg::register_CameraPicture_type_identifier(ids);
  msg::register_SensorPoints_type_identifier(ids);
  msg::register_DepthImage_type_identifier(ids);
  msg::register_HapticDevice_type_identifier(ids);
  msg::register_HapticDeviceWrench_type_identifier(ids);
  msg::register_WorkspaceBrick_type_identifier(ids);
  msg::register_WorkspaceVersion_type_identifier(ids);
  msg::register_WorkspaceObject_type_identifier(ids);
  msg::register_ObjectUncertainty_type_identifier(ids);
  msg::register_PoseFinding_type_identifier(ids);
  msg::register_LiveObject_type_identifier(ids);
  msg::register_MeshChunk_type_identifier(ids);
  msg::register_OccupancyChange_type_identifier(ids);
  msg::register_SpaceView_type_identifier(ids);
  msg::register_WorkspaceCommand_type_identifier(ids);
  msg::register_WorkspaceReply_type_identifier(ids);
  msg::register_ComponentStatus_type_identifier(ids);
}

TypePtr type_by(const edds::xtypes::TypeObject& object) {
  const auto builder = edds::DynamicTypeBuilderFactory::get_instance()->create_type_w_type_object(object);
  if (!builder) throw std::logic_error("its description is contradictory");
  return Description().of(builder->build());
}

/// The project's types, and those that were learned.
class Catalogue {
 public:
  Catalogue() {
    register_topics();
    for (const dds::TopicDescription* topic : dds::all_topics()) {
      edds::xtypes::TypeObjectPair objects;
      if (!fast_dds::ok(registry().get_type_objects(topic->type_name, objects)))
        throw std::logic_error(std::string(topic->type_name) + ": not generated");
      known_[topic->type_name] = type_by(objects.complete_type_object);
    }
  }
  TypePtr find(const std::string& name) {
    const std::lock_guard lock(mutex_);
    const auto found = known_.find(name);
    return found != known_.end() ? found->second : nullptr;
  }
  void learn(const std::string& name, const fast_dds::DescribedType& described) {
    const std::lock_guard lock(mutex_);
    if (learned_ == kMaxLearned || !known_.try_emplace(name).second) return;
    ++learned_;
    try {
      edds::xtypes::TypeObject object;
      if (!fast_dds::ok(registry().get_type_object(described, object)))
        throw std::logic_error("its owner does not describe it");
      known_[name] = type_by(object);
    } catch (const std::exception& problem) {
      spdlog::warn("type {} is not decoded: {}", name, problem.what());
    }
  }

 private:
  static constexpr std::size_t kMaxLearned = 256;

  static edds::xtypes::ITypeObjectRegistry& registry() {
    return edds::DomainParticipantFactory::get_instance()->type_object_registry();
  }

  std::mutex mutex_;
  std::map<std::string, TypePtr> known_;  // null: not decoded
  std::size_t learned_ = 0;
};

Catalogue& catalogue() {
  static Catalogue one;
  return one;
}

}  // namespace

void learn_type(const std::string& type_name, const fast_dds::DescribedType& described) {
  if (described._d() != edds::xtypes::TK_NONE) catalogue().learn(type_name, described);
}

TypePtr type_of(const std::string& type_name) { return catalogue().find(type_name); }

}  // namespace phantom::observation
