#pragma once

// Every topic of the system: name, type and QoS contract in one constant that both ends include, made from
// the IDL by idl/contract.py. Only a component's dds_adapter includes this file.

#include "phantom_contract/topics.hpp"
