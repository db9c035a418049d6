// SPDX-License-Identifier: Apache-2.0
// Generates two texts from the table of fields: the JSON Schema, which is checked in as schema.json and
// served to clients, and the section of PROTOCOL.md about fields.
#pragma once
#include <string>

#include "protocol/lists.h"

namespace scolopax::protocol {

/// JSON Schema 2020-12 of the scene, indented, with a newline at its end.
std::string schemaText(const Lists& lists);

/// Markdown: one table of fields per object of the scene, and one per list of names.
std::string fieldsMarkdown(const Lists& lists);

}  // namespace scolopax::protocol
