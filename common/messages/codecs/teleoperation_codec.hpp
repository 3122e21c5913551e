#pragma once

// Codecs of the topics of idl/teleoperation.idl: from_idl(), read() and to_idl() of each.

#include "phantom_contract/teleoperation_codec.hpp"
