// SPDX-License-Identifier: MIT
#pragma once

/// Modular devices (CiA 306, 4.7): a file describes types of modules, such as those that are plugged into a
/// bus coupler, and its objects depend on the ones that are there. [M2ModuleInfo] and so on belong to type 2.
///
/// * [M2Fixed6423] and [M2Fixed6423sub1] are objects that are there once if a module of the type is.
/// * [M2SubExt6000] appends sub-indices to 6000h for each module, after those of the file itself. `Count=2`
///   is two of them. `Count=0;4` is four bits of one, which the next modules fill up; a new one begins where
///   it has no more room, or after a whole one. [M2SubExt6000sub1] and so on are different ones.
/// * After sub-index `ObjExtend`, if it is not 0, the next index is used, from sub-index 1 on.
/// * Sub-index 0 of an object that is extended is its highest sub-index.
///
/// What CiA 306 does not say: a missing Count is 1. Sections count, not the lists of them. Of two sections
/// for the same sub-index the first one is used, and the file's own before those of modules. A default
/// mapping of a PDO ends at the first object that is missing. If it is empty and the profile is CiA 401, it
/// is the profile's. A DCF may have the objects of its modules as its own too, so an object with sub-indices
/// is not extended there.

#include <deque>
#include <span>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "descriptions/lexer.hpp"
#include "descriptions/object_sections.hpp"

namespace cbcan::descriptions {

/// Sub-indices of object 1027h, which lists the modules: the last position in [ConnectedModules].
inline constexpr std::size_t kMostModules = 254;
/// The sections made for the modules of a device.
inline constexpr std::size_t kMostModuleBytes = 1U << 22;

/// A device that cannot have these modules.
class ModuleError : public base::UsageError {
 public:
  using UsageError::UsageError;
};

/// What sections made for modules refer to.
struct ModuleTexts {
  std::deque<std::string> texts;
  std::deque<std::vector<KeyValue>> entries;
};

/// Replaces the sections of modules by those of the objects that a device with these modules has. `modules`:
/// names ([M2ModuleInfo] ProductName) or numbers of types, in the order of their positions; empty = those of
/// `connected`, [ConnectedModules], which may be null. False: there are none, and nothing has been changed.
/// Throws ModuleError if `modules` has a type that is not in the file, whose name `file` is.
bool connect_modules(std::vector<Section>& sections, std::span<const std::string> modules,
                     const Section* connected, const std::string& file, ValueReader& values,
                     Findings& findings, ModuleTexts& made);

/// The sections as the text of a file, with lists of the objects that are there.
std::string to_text(const std::vector<Section>& sections);

}  // namespace cbcan::descriptions
