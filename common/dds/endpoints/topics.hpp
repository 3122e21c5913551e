#pragma once

// Every topic of the system: name, type and QoS contract in one constant that both ends include.
// Only a component's dds_adapter includes this file.

#include <cstdint>

#include "phantom_idl/haptic_device.hpp"
#include "phantom_idl/percept.hpp"
#include "phantom_idl/status.hpp"
#include "phantom_idl/teleoperation.hpp"
#include "phantom_idl/workspace.hpp"

namespace eprosima::fastdds::dds {
class TypeSupport;
}

namespace phantom::dds {

enum class Reliability { kBestEffort, kReliable };
enum class Durability { kVolatile, kTransientLocal };

/// What both ends of a topic may rely on. The XML profile named as the topic must agree (checked at start).
/// No sample expires by DDS (lifespan): that would compare the wall clocks of two hosts.
struct QosContract {
  Reliability reliability = Reliability::kReliable;
  Durability durability = Durability::kVolatile;
  int history_depth = 1;  ///< KEEP_LAST depth per instance; 0: KEEP_ALL
  int deadline_ms = 0;    ///< 0: none
  int liveliness_ms = 0;  ///< lease of MANUAL_BY_TOPIC liveliness; 0: automatic, without a lease
};

/// A TopicSpec without its sample type: for lists, tables and tools.
struct TopicDescription {
  const char* name;
  const char* type_name;
  QosContract qos;
  eprosima::fastdds::dds::TypeSupport (*make_type)();
  bool foreign = false;        ///< a topic of others: it has no XML profile, and the contract alone holds
  const char* user_data = "";  ///< USER_DATA of the endpoint; empty: none
};

template <class T>
struct TopicSpec : TopicDescription {};

extern const TopicSpec<msg::MasterState> kMasterState;                ///< 1 kHz
extern const TopicSpec<msg::SlaveState> kSlaveState;                  ///< 1 kHz
extern const TopicSpec<msg::GripperState> kGripperState;              ///< 100 Hz, where there is a gripper
extern const TopicSpec<msg::DragField> kDragField;                    ///< 1 kHz
extern const TopicSpec<msg::Percept> kPercept;                        ///< 100 Hz
extern const TopicSpec<msg::InterestPoints> kInterestPoints;          ///< 100 Hz
extern const TopicSpec<msg::SkinPercept> kSkinPercept;                ///< 20 Hz
extern const TopicSpec<msg::HitAlert> kHitAlert;                      ///< on events
extern const TopicSpec<msg::SensingCommand> kSensingCommand;          ///< on events
extern const TopicSpec<msg::SensingReply> kSensingReply;              ///< on events
extern const TopicSpec<msg::OperatorCommand> kOperatorCommand;        ///< on events
extern const TopicSpec<msg::OperatorCommand> kRecordingRequest;       ///< on request; kind MARK
extern const TopicSpec<msg::OperatorReply> kOperatorReply;            ///< on events
extern const TopicSpec<msg::WristWrench> kWristWrench;                ///< at the sensor's rate
extern const TopicSpec<msg::ViewPose> kViewPose;                      ///< 10 Hz
extern const TopicSpec<msg::ViewPicture> kViewPicture;                ///< at most as configured
extern const TopicSpec<msg::CameraPicture> kCameraPicture;            ///< at the camera's rate
extern const TopicSpec<msg::SensorPoints> kSensorPoints;              ///< at the sensor's rate
extern const TopicSpec<msg::DepthImage> kDepthImage;                  ///< at the camera's rate
extern const TopicSpec<msg::HapticDevice> kHapticDevice;              ///< at its device's rate
extern const TopicSpec<msg::HapticDeviceWrench> kHapticDeviceWrench;  ///< 1 kHz
extern const TopicSpec<msg::WorkspaceBrick> kWorkspaceBrick;          ///< durable
extern const TopicSpec<msg::WorkspaceVersion> kWorkspaceVersion;      ///< durable
extern const TopicSpec<msg::WorkspaceObject> kWorkspaceObject;        ///< durable
extern const TopicSpec<msg::MeshChunk> kMeshChunk;                    ///< durable
extern const TopicSpec<msg::OccupancyChange> kOccupancyChange;        ///< with each image, 10 Hz at least
extern const TopicSpec<msg::WorkspaceCommand> kWorkspaceCommand;      ///< on events
extern const TopicSpec<msg::WorkspaceReply> kWorkspaceReply;          ///< on events
extern const TopicSpec<msg::ComponentStatus> kComponentStatus;        ///< 2 Hz

}  // namespace phantom::dds
