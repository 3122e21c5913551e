#include "cyclone_topics.h"

#include "haptic_device.h"
#include "percept.h"
#include "status.h"
#include "teleoperation.h"
#include "workspace.h"

#define TYPE(name) \
  { "phantom::msg::" #name, &phantom_msg_##name##_desc }

const struct cyclone_type cyclone_types[] = {
    TYPE(MasterState),     TYPE(SlaveState),      TYPE(DragField),
    TYPE(Percept),         TYPE(InterestPoints),  TYPE(SkinPercept),
    TYPE(HitAlert),        TYPE(SensingCommand),  TYPE(SensingReply),
    TYPE(OperatorCommand), TYPE(WorkspaceBrick),  TYPE(WorkspaceVersion),
    TYPE(WorkspaceObject), TYPE(MeshChunk),       TYPE(WorkspaceCommand),
    TYPE(WorkspaceReply),  TYPE(ComponentStatus), TYPE(ViewPose),
    TYPE(OperatorReply),   TYPE(HapticDevice),    TYPE(HapticDeviceWrench),
    TYPE(GripperState),    TYPE(WristWrench),
    TYPE(ViewPicture),     TYPE(SensorPoints),    TYPE(CameraPicture),
    TYPE(DepthImage),      TYPE(OccupancyChange),
    {0, 0}};
