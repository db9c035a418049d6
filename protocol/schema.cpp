// SPDX-License-Identifier: Apache-2.0
#include "protocol/schema.h"

#include "protocol/read_fields.h"

namespace scolopax::protocol {

std::string schemaText(const Lists&) { return "{}\n"; }
std::string fieldsMarkdown(const Lists&) { return ""; }

}  // namespace scolopax::protocol
