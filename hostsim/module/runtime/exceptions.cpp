// SPDX-License-Identifier: MIT
// Exceptions for WebAssembly: Debian's libc++abi has none for it. The compiler calls these functions of the
// Itanium C++ ABI; tables (LSDA) are as in its "Exception Handling", but call sites are taken by their
// number, as WebAssembly has no addresses of code. Constructors and destructors return `this` there. What is
// thrown inside libc++.a traps.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <new>
#include <typeinfo>

namespace cbcan::module {

/// libc++abi's type information, by the order of its virtual functions.
class CatchableType : public std::type_info {
 public:
  virtual void noop1() const;
  virtual void noop2() const;
  virtual bool can_catch(const std::type_info* thrown, void*& adjusted) const;
};

}  // namespace cbcan::module

namespace {

using cbcan::module::CatchableType;

/// Header in front of a thrown object; its address is what the instruction `throw` carries.
struct alignas(std::max_align_t) Header {
  const std::type_info* type;
  void* (*destroy)(void*);
  void* adjusted;  ///< the object, as its handler sees it
  int handlers;    ///< that have begun and not ended
  bool rethrown;
  Header* outer;  ///< of the handler around this one's
};

Header* caught = nullptr;  ///< by the innermost handler

Header* header_of(void* object) {
  return static_cast<Header*>(object) - 1;
}

std::uintptr_t read_uleb(const std::uint8_t*& at) {
  std::uintptr_t value = 0;
  for (unsigned shift = 0;; shift += 7) {
    const std::uint8_t byte = *at++;
    value |= std::uintptr_t{byte & 0x7Fu} << shift;
    if ((byte & 0x80) == 0) return value;
  }
}

std::intptr_t read_sleb(const std::uint8_t*& at) {
  const std::uint8_t* const begin = at;
  const std::uintptr_t value = read_uleb(at);
  const auto bits = static_cast<unsigned>(7 * (at - begin));
  const bool negative = bits < 32 && (at[-1] & 0x40) != 0;
  return static_cast<std::intptr_t>(negative ? value | ~std::uintptr_t{0} << bits : value);
}

/// The entry of the type table that catches the exception, on the list of actions at `action`; 0 = none.
std::uintptr_t selector_of(const std::uint8_t* action, const std::uint8_t* types, Header& header) {
  while (true) {
    const std::intptr_t entry = read_sleb(action);
    const std::uint8_t* const here = action;
    const std::intptr_t next = read_sleb(action);
    if (entry > 0) {
      const auto* const type = reinterpret_cast<const CatchableType* const*>(types)[-entry];
      void* adjusted = &header + 1;
      if (type == nullptr || type->can_catch(header.type, adjusted)) {
        header.adjusted = adjusted;
        return static_cast<std::uintptr_t>(entry);
      }
    }
    if (next == 0) return 0;
    action = here + next;
  }
}

[[noreturn]] void raise(Header* header) {
  __builtin_wasm_throw(0, header);
}

}  // namespace

extern "C" {

/// What a landing pad and the function below tell each other.
struct {
  std::uintptr_t pad;  ///< its number
  const std::uint8_t* tables;
  std::uintptr_t selector;
} __wasm_lpad_context;

int _Unwind_CallPersonality(void* exception) {
  constexpr std::uint8_t kOmitted = 0xFF;
  const std::uint8_t* at = __wasm_lpad_context.tables;
  __wasm_lpad_context.selector = 0;
  ++at;  // the base of landing pads is omitted
  const std::uint8_t* types = nullptr;
  if (*at++ != kOmitted) {
    const std::uintptr_t offset = read_uleb(at);
    types = at + offset;
  }
  ++at;  // call sites are in ULEB
  const std::uintptr_t size = read_uleb(at);
  const std::uint8_t* const actions = at + size;
  for (std::uintptr_t pad = 0;; ++pad) {
    read_uleb(at);
    const std::uintptr_t action = read_uleb(at);
    if (pad != __wasm_lpad_context.pad) continue;
    if (action != 0)
      __wasm_lpad_context.selector =
          selector_of(actions + action - 1, types, *static_cast<Header*>(exception));
    return 0;
  }
}

void* __cxa_allocate_exception(std::size_t size) noexcept {
  auto* const header = static_cast<Header*>(std::malloc(sizeof(Header) + size));
  if (header == nullptr) std::terminate();
  return header + 1;
}

void __cxa_free_exception(void* object) noexcept {
  std::free(header_of(object));
}

[[noreturn]] void __cxa_throw(void* object, std::type_info* type, void* (*destroy)(void*)) {
  raise(new (header_of(object)) Header{type, destroy, object, 0, false, nullptr});
}

void* __cxa_get_exception_ptr(void* exception) noexcept {
  return static_cast<Header*>(exception)->adjusted;
}

void* __cxa_begin_catch(void* exception) noexcept {
  auto* const header = static_cast<Header*>(exception);
  header->rethrown = false;
  if (header->handlers++ == 0) {
    header->outer = caught;
    caught = header;
  }
  return header->adjusted;
}

void __cxa_end_catch() {
  Header* const header = caught;
  if (--header->handlers != 0) return;
  caught = header->outer;
  if (header->rethrown) return;
  if (header->destroy != nullptr) header->destroy(header + 1);
  std::free(header);
}

[[noreturn]] void __cxa_rethrow() {
  if (caught == nullptr) std::terminate();
  caught->rethrown = true;
  raise(caught);
}

}  // extern "C"
