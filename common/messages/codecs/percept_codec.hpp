#pragma once

// Codecs of the topics of idl/percept.idl: from_idl(), read() and to_idl() of each.

#include "phantom_contract/percept_codec.hpp"
