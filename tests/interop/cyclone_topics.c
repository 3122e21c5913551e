#include "cyclone_topics.h"

#include "haptic_device.h"
#include "percept.h"
#include "status.h"
#include "teleoperation.h"
#include "workspace.h"

#define TOPIC(constant, name) {"phantom::msg::" #name, &phantom_msg_##name##_desc},

const struct cyclone_type cyclone_types[] = {
#include "phantom_contract/topics.def"
    {0, 0}};
