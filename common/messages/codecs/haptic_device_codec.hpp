#pragma once

// Codecs of the topics of idl/haptic_device.idl: from_idl(), read() and to_idl() of each.

#include "phantom_contract/haptic_device_codec.hpp"
