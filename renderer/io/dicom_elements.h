// SPDX-License-Identifier: Apache-2.0
// Values of DICOM elements as text and numbers, whatever a file contains. From GDCM's data sets to
// dicom_file.h.
#pragma once
#if SCOLOPAX_HAS_GDCM
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "renderer/io/dicom_gdcm.h"
#include "renderer/io/dicom_tags.h"
#include "renderer/io/text.h"

namespace scolopax::io {

inline bool hasDicom(const gdcm::DataSet& set, const DicomTag& tag) {
  return set.FindDataElement(gdcm::Tag(tag.group, tag.element));
}

/// The bytes of an element; none if it is absent, empty or a sequence.
inline std::string_view dicomBytes(const gdcm::DataSet& set, const DicomTag& tag) {
  if (!hasDicom(set, tag)) return {};
  const gdcm::ByteValue* value = set.GetDataElement(gdcm::Tag(tag.group, tag.element)).GetByteValue();
  if (!value || value->GetLength() == 0) return {};
  return {value->GetPointer(), value->GetLength()};
}

/// Text without the blanks and zeros that fill it up.
inline std::string dicomText(const gdcm::DataSet& set, const DicomTag& tag) {
  std::string_view bytes = dicomBytes(set, tag);
  bytes = bytes.substr(0, bytes.find('\0'));
  return std::string(trimmed(bytes));
}

/// The values of a decimal string; none if one of them is no number.
inline std::vector<double> dicomDecimals(const gdcm::DataSet& set, const DicomTag& tag) {
  const std::string text = dicomText(set, tag);
  std::vector<double> values;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t end = std::min(rest.find('\\'), rest.size());
    const auto value = parseNumber(trimmed(rest.substr(0, end)));
    if (!value || !std::isfinite(*value)) return {};
    values.push_back(*value);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return values;
}
inline std::optional<double> dicomDecimal(const gdcm::DataSet& set, const DicomTag& tag) {
  const auto values = dicomDecimals(set, tag);
  return values.empty() ? std::nullopt : std::optional(values[0]);
}

/// The first value of an element of 16 or 32-bit whole numbers, by its length.
inline std::optional<std::int64_t> dicomUnsigned(const gdcm::DataSet& set, const DicomTag& tag) {
  const std::string_view bytes = dicomBytes(set, tag);
  std::uint16_t small = 0;
  std::uint32_t large = 0;
  if (bytes.size() == sizeof small) {
    std::memcpy(&small, bytes.data(), sizeof small);
    return small;
  }
  if (bytes.size() < sizeof large) return {};
  std::memcpy(&large, bytes.data(), sizeof large);
  return large;
}

/// Calls visit(item) for the items of a sequence, as long as it returns true.
template <class Visit>
void visitDicomItems(const gdcm::DataSet& set, const DicomTag& tag, Visit&& visit) {
  if (!hasDicom(set, tag)) return;
  const gdcm::SmartPointer<gdcm::SequenceOfItems> items =
      set.GetDataElement(gdcm::Tag(tag.group, tag.element)).GetValueAsSQ();
  if (!items) return;
  for (std::size_t i = 1; i <= items->GetNumberOfItems(); ++i)
    if (!visit(items->GetItem(i).GetNestedDataSet())) return;
}

/// The same for the first item only.
template <class Visit>
void withDicomItem(const gdcm::DataSet& set, const DicomTag& tag, Visit&& visit) {
  visitDicomItems(set, tag, [&](const gdcm::DataSet& item) {
    visit(item);
    return false;
  });
}

}  // namespace scolopax::io
#endif
