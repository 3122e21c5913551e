#pragma once

// Codecs of the topics of idl/status.idl: from_idl(), read() and to_idl() of each.

#include "phantom_contract/status_codec.hpp"
