#include "common/dds/endpoints/topics.hpp"

#include "common/dds/endpoints/topic_list.hpp"
#include "fast_dds/type_support.hpp"
#include "phantom_idl/haptic_devicePubSubTypes.hpp"
#include "phantom_idl/perceptPubSubTypes.hpp"
#include "phantom_idl/statusPubSubTypes.hpp"
#include "phantom_idl/teleoperationPubSubTypes.hpp"
#include "phantom_idl/workspacePubSubTypes.hpp"

namespace phantom::dds {
namespace {

using eprosima::fastdds::dds::TypeSupport;

// Type information is not announced: it makes other vendors refuse the endpoint, and a type object with a
// sequence of structs crashes participants that lack the type.
template <class PubSubType>
TypeSupport make_type() {
  TypeSupport type(new fast_dds::Refusing<PubSubType>());
  fast_dds::announce_name_only(*type);
  return type;
}

// A periodic state: only the newest sample counts, and a lost one is not resent. It has no lifespan, which
// compares the wall clocks of two hosts; each receiver decides by its own monotonic clock whether a sample is
// stale (watchdogs) or was held up on its way (DelayMonitor).
constexpr QosContract periodic(int deadline_ms, int liveliness_ms) {
  return {.reliability = Reliability::kBestEffort,
          .durability = Durability::kVolatile,
          .history_depth = 1,
          .deadline_ms = deadline_ms,
          .liveliness_ms = liveliness_ms};
}
constexpr QosContract kEvent{.reliability = Reliability::kReliable, .history_depth = 64};
// No deadline on a keyed topic: this version of Fast DDS counts misses of instances that keep their deadline.
// Receivers of component_status watch its age.
constexpr QosContract kDurable{
    .reliability = Reliability::kReliable, .durability = Durability::kTransientLocal, .history_depth = 1};
// Large and periodic: the newest counts, and a fragment that is lost is sent again, as it would cost the
// whole sample. What may need fragments is never best effort: such a reader of Fast DDS 3.1 ends its process
// after a lost fragment (docs/fast_dds.md).
constexpr QosContract kLarge{.reliability = Reliability::kReliable, .history_depth = 1};
constexpr QosContract periodic_and_large(int deadline_ms, int liveliness_ms) {
  QosContract contract = periodic(deadline_ms, liveliness_ms);
  contract.reliability = Reliability::kReliable;
  return contract;
}

}  // namespace

const TopicSpec<msg::MasterState> kMasterState{
    {"master_state", "phantom::msg::MasterState", periodic(20, 200), &make_type<msg::MasterStatePubSubType>}};
const TopicSpec<msg::SlaveState> kSlaveState{
    {"slave_state", "phantom::msg::SlaveState", periodic(20, 200), &make_type<msg::SlaveStatePubSubType>}};
const TopicSpec<msg::GripperState> kGripperState{{"gripper_state", "phantom::msg::GripperState",
                                                  periodic(100, 500),
                                                  &make_type<msg::GripperStatePubSubType>}};
const TopicSpec<msg::DragField> kDragField{
    {"drag_field", "phantom::msg::DragField", periodic(20, 200), &make_type<msg::DragFieldPubSubType>}};
const TopicSpec<msg::Percept> kPercept{
    {"percept", "phantom::msg::Percept", periodic(100, 500), &make_type<msg::PerceptPubSubType>}};
const TopicSpec<msg::InterestPoints> kInterestPoints{{"interest_points", "phantom::msg::InterestPoints",
                                                      periodic(100, 500),
                                                      &make_type<msg::InterestPointsPubSubType>}};
const TopicSpec<msg::SkinPercept> kSkinPercept{{"skin_percept", "phantom::msg::SkinPercept",
                                                periodic_and_large(500, 2000),
                                                &make_type<msg::SkinPerceptPubSubType>}};
const TopicSpec<msg::HitAlert> kHitAlert{
    {"hit_alert", "phantom::msg::HitAlert", kEvent, &make_type<msg::HitAlertPubSubType>}};
const TopicSpec<msg::SensingCommand> kSensingCommand{
    {"sensing_command", "phantom::msg::SensingCommand", kEvent, &make_type<msg::SensingCommandPubSubType>}};
const TopicSpec<msg::SensingReply> kSensingReply{
    {"sensing_reply", "phantom::msg::SensingReply", kEvent, &make_type<msg::SensingReplyPubSubType>}};
const TopicSpec<msg::WristWrench> kWristWrench{
    {"wrist_wrench", "phantom::msg::WristWrench", periodic(20, 200), &make_type<msg::WristWrenchPubSubType>}};
const TopicSpec<msg::OperatorCommand> kOperatorCommand{{"operator_command", "phantom::msg::OperatorCommand",
                                                        kEvent, &make_type<msg::OperatorCommandPubSubType>}};
const TopicSpec<msg::OperatorCommand> kRecordingRequest{{"recording_request", "phantom::msg::OperatorCommand",
                                                         kEvent, &make_type<msg::OperatorCommandPubSubType>}};
const TopicSpec<msg::OperatorReply> kOperatorReply{
    {"operator_reply", "phantom::msg::OperatorReply", kEvent, &make_type<msg::OperatorReplyPubSubType>}};
const TopicSpec<msg::ViewPose> kViewPose{
    {"view_pose", "phantom::msg::ViewPose", periodic(500, 2000), &make_type<msg::ViewPosePubSubType>}};
const TopicSpec<msg::ViewPicture> kViewPicture{
    {"view_picture", "phantom::msg::ViewPicture", kLarge, &make_type<msg::ViewPicturePubSubType>}};
const TopicSpec<msg::CameraPicture> kCameraPicture{
    {"camera_picture", "phantom::msg::CameraPicture", kLarge, &make_type<msg::CameraPicturePubSubType>}};
const TopicSpec<msg::SensorPoints> kSensorPoints{
    {"sensor_points", "phantom::msg::SensorPoints", kLarge, &make_type<msg::SensorPointsPubSubType>}};
const TopicSpec<msg::DepthImage> kDepthImage{
    {"depth_image", "phantom::msg::DepthImage", kLarge, &make_type<msg::DepthImagePubSubType>}};
const TopicSpec<msg::HapticDevice> kHapticDevice{{"haptic_device", "phantom::msg::HapticDevice",
                                                  periodic(20, 200),
                                                  &make_type<msg::HapticDevicePubSubType>}};
const TopicSpec<msg::HapticDeviceWrench> kHapticDeviceWrench{
    {"haptic_device_wrench", "phantom::msg::HapticDeviceWrench", periodic(20, 200),
     &make_type<msg::HapticDeviceWrenchPubSubType>}};
const TopicSpec<msg::WorkspaceBrick> kWorkspaceBrick{
    {"workspace_brick", "phantom::msg::WorkspaceBrick", kDurable, &make_type<msg::WorkspaceBrickPubSubType>}};
const TopicSpec<msg::WorkspaceVersion> kWorkspaceVersion{{"workspace_version",
                                                          "phantom::msg::WorkspaceVersion", kDurable,
                                                          &make_type<msg::WorkspaceVersionPubSubType>}};
const TopicSpec<msg::WorkspaceObject> kWorkspaceObject{{"workspace_object", "phantom::msg::WorkspaceObject",
                                                        kDurable,
                                                        &make_type<msg::WorkspaceObjectPubSubType>}};
const TopicSpec<msg::MeshChunk> kMeshChunk{
    {"mesh_chunk", "phantom::msg::MeshChunk", kDurable, &make_type<msg::MeshChunkPubSubType>}};
const TopicSpec<msg::OccupancyChange> kOccupancyChange{{"occupancy_change", "phantom::msg::OccupancyChange",
                                                        kEvent, &make_type<msg::OccupancyChangePubSubType>}};
const TopicSpec<msg::WorkspaceCommand> kWorkspaceCommand{{"workspace_command",
                                                          "phantom::msg::WorkspaceCommand", kEvent,
                                                          &make_type<msg::WorkspaceCommandPubSubType>}};
const TopicSpec<msg::WorkspaceReply> kWorkspaceReply{
    {"workspace_reply", "phantom::msg::WorkspaceReply", kEvent, &make_type<msg::WorkspaceReplyPubSubType>}};
const TopicSpec<msg::ComponentStatus> kComponentStatus{{"component_status", "phantom::msg::ComponentStatus",
                                                        kDurable,
                                                        &make_type<msg::ComponentStatusPubSubType>}};

std::span<const TopicDescription* const> all_topics() {
  static const TopicDescription* const topics[] = {
      &kMasterState,        &kSlaveState,       &kGripperState,     &kDragField,       &kPercept,
      &kInterestPoints,     &kSkinPercept,      &kHitAlert,         &kSensingCommand,  &kSensingReply,
      &kOperatorCommand,    &kRecordingRequest, &kOperatorReply,    &kWristWrench,     &kViewPose,
      &kViewPicture,        &kCameraPicture,    &kSensorPoints,     &kDepthImage,      &kHapticDevice,
      &kHapticDeviceWrench, &kWorkspaceBrick,   &kWorkspaceVersion, &kWorkspaceObject, &kMeshChunk,
      &kOccupancyChange,    &kWorkspaceCommand, &kWorkspaceReply,   &kComponentStatus};
  return topics;
}

}  // namespace phantom::dds
