// SPDX-License-Identifier: MIT
// Every key of the scene format, once: name, type, range, default, meaning. The reader, the writer's order of new keys, the
// JSON Schema and the key lists of messages all come from these tables. Keys of shapes and warps are not here: sdf/tables.h has them.
#pragma once

#include "sdf/tables.h"

#include <cstdint>
#include <span>
#include <string_view>

namespace kiln::scene {

enum class KeyType : uint8_t {
    Numbers,   ///< `numbers.arity` numbers (1: a plain number)
    Scale,     ///< one number or three, > 0
    Rotation,  ///< quaternion [x, y, z, w]
    Bool,
    Text,
    TextList,
    Choice,  ///< one of `choices`
    Object,  ///< members by `table`
    List,    ///< array of `table`; any values when there is none
    Map,     ///< object of name -> `table`
    Node,    ///< an edit's or a tree node's own keys: shape, object, children, domain
    Pinned,  ///< "top", "corners" or [[i, j], ...]
};

struct Table;

struct KeyRow {
    std::string_view name;
    KeyType type;
    std::string_view doc;
    sdf::FieldRow numbers{};  ///< Numbers; offset: index of the first float in the C++ struct, -1: kept as JSON only
    std::span<const std::string_view> choices{};
    const Table* table = nullptr;
    bool required = false;
    uint8_t kinds = 0xff;  ///< lights: bit per Light::Kind that has this key
};

struct Table {
    std::string_view name;  ///< of the schema's definition
    std::string_view doc;
    std::span<const KeyRow> rows;
};

const KeyRow* find_row(const Table& table, std::string_view key);

extern const Table kSceneTable;  // the whole file
extern const Table kFieldTable, kBoundsTable, kMaterialTable, kLightTable, kEnvironmentTable, kCameraTable;
extern const Table kEditTable;  // keys of edits, the node's among them
extern const Table kNodeTable;  // keys of nodes in objects
extern const Table kOutlineTable, kMeshTable, kPhysicsTable, kBodyTable, kTriggerTable, kWishTable, kCharacterTable,
    kClothTable, kFluidTable;

extern const std::span<const std::string_view> kOpNames, kLightNames, kToneMapNames, kBloomKindNames, kAxisNames,
    kMotionNames;

/// Metres beyond which nothing is accepted: squares of larger numbers lose all precision in float.
inline constexpr float kFarthest = 1e9f;
inline constexpr float kSmallestScale = 1e-6f, kLargestScale = 1e6f;

}  // namespace kiln::scene
