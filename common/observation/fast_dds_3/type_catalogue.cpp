#include "common/observation/type_catalogue.hpp"

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

#include "fast_dds/types.hpp"
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

TypePtr described(const DynamicType& dynamic);

edds::TypeDescriptor::_ref_type descriptor_of(const DynamicType& dynamic) {
  auto descriptor = edds::traits<edds::TypeDescriptor>::make_shared();
  if (!fast_dds::ok(dynamic->get_descriptor(descriptor)))
    throw std::logic_error(std::string(dynamic->get_name()) + ": a type without a description");
  return descriptor;
}

// double x[2][3] is an array of two arrays of three.
TypePtr array_of(const edds::TypeDescriptor& descriptor) {
  TypePtr inner = described(descriptor.element_type());
  for (auto bound = descriptor.bound().rbegin(); bound != descriptor.bound().rend(); ++bound) {
    Type array{.kind = Kind::kArray, .element = inner, .bound = *bound};
    inner = std::make_shared<Type>(std::move(array));
  }
  return inner;
}

void add_members(const DynamicType& dynamic, Type& type) {
  for (std::uint32_t i = 0; i < dynamic->get_member_count(); ++i) {
    edds::DynamicTypeMember::_ref_type member;
    auto descriptor = edds::traits<edds::MemberDescriptor>::make_shared();
    if (!fast_dds::ok(dynamic->get_member_by_index(member, i)) ||
        !fast_dds::ok(member->get_descriptor(descriptor)))
      throw std::logic_error(type.name + ": a member without a description");
    if (type.kind == Kind::kEnum) {
      type.literals.push_back({std::string(member->get_name()),
                               static_cast<std::uint32_t>(std::stoul(descriptor->default_value()))});
    } else {
      type.members.push_back(
          {std::string(member->get_name()), described(descriptor->type()), descriptor->is_key()});
    }
  }
}

TypePtr described(const DynamicType& dynamic) {
  if (!dynamic) throw std::logic_error("a member without a type");
  const edds::TypeKind kind = dynamic->get_kind();
  if (const auto primitive = kPrimitives.find(kind); primitive != kPrimitives.end())
    return std::make_shared<Type>(Type{.kind = primitive->second});
  const auto descriptor = descriptor_of(dynamic);
  Type type;
  switch (kind) {
    case edds::TK_ALIAS:
      return described(descriptor->base_type());
    case edds::TK_ARRAY:
      return array_of(*descriptor);
    case edds::TK_STRING8:
    case edds::TK_SEQUENCE:
      type.kind = kind == edds::TK_SEQUENCE ? Kind::kSequence : Kind::kString;
      type.bound = descriptor->bound().at(0);
      if (kind == edds::TK_SEQUENCE) type.element = described(descriptor->element_type());
      break;
    case edds::TK_ENUM:
    case edds::TK_STRUCTURE:
      type.kind = kind == edds::TK_ENUM ? Kind::kEnum : Kind::kStruct;
      type.name = std::string(dynamic->get_name());
      add_members(dynamic, type);
      break;
    default:
      throw std::logic_error(std::string(dynamic->get_name()) + ": a kind of type that is not decoded");
  }
  return std::make_shared<Type>(std::move(type));
}

// Each registers the types that it uses, too.
void register_topics() {
  static std::once_flag once;
  std::call_once(once, [] {
    edds::xtypes::TypeIdentifierPair ids;
    msg::register_MasterState_type_identifier(ids);
    msg::register_SlaveState_type_identifier(ids);
    msg::register_DragField_type_identifier(ids);
    msg::register_Percept_type_identifier(ids);
    msg::register_InterestPoints_type_identifier(ids);
    msg::register_SkinPercept_type_identifier(ids);
    msg::register_HitAlert_type_identifier(ids);
    msg::register_SensingCommand_type_identifier(ids);
    msg::register_SensingReply_type_identifier(ids);
    msg::register_OperatorCommand_type_identifier(ids);
    msg::register_OperatorReply_type_identifier(ids);
    msg::register_ViewPose_type_identifier(ids);
    msg::register_WorkspaceBrick_type_identifier(ids);
    msg::register_WorkspaceVersion_type_identifier(ids);
    msg::register_WorkspaceObject_type_identifier(ids);
    msg::register_MeshChunk_type_identifier(ids);
    msg::register_WorkspaceCommand_type_identifier(ids);
    msg::register_WorkspaceReply_type_identifier(ids);
    msg::register_ComponentStatus_type_identifier(ids);
  });
}

TypePtr looked_up(const std::string& name) {
  register_topics();
  auto& registry = edds::DomainParticipantFactory::get_instance()->type_object_registry();
  edds::xtypes::TypeObjectPair objects;
  if (!fast_dds::ok(registry.get_type_objects(name, objects))) return nullptr;
  const auto builder = edds::DynamicTypeBuilderFactory::get_instance()->create_type_w_type_object(
      objects.complete_type_object);
  return builder ? described(builder->build()) : nullptr;
}

}  // namespace

TypePtr type_of(const std::string& type_name) {
  static std::mutex mutex;
  static std::map<std::string, TypePtr> known;
  const std::lock_guard lock(mutex);
  const auto [place, added] = known.try_emplace(type_name);
  if (added) place->second = looked_up(type_name);
  return place->second;
}

}  // namespace phantom::observation
