// Reads a volume package in one file (.volpkg.zip) in C#, without dependencies: for Unity, or any .NET.
// It follows formats/spec: the directory of the zip, digests, the manifest, textures. It refuses files that are damaged,
// but checks less than volpkg.h does: take packages that `volprep validate` has seen.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Reflection;
using System.Security.Cryptography;
using System.Text;

namespace Volpkg {

/// A package cannot be read. The code is that of the other readers.
public sealed class PackageException : Exception {
  public readonly string Code;
  public PackageException(string code, string problem) : base(code + " " + problem) { Code = code; }
}

/// A package in memory.
public sealed class VolumePackage {
  const int MostManifestBytes = 4194304;
  readonly byte[] data;
  readonly Dictionary<string, ArraySegment<byte>> files = new Dictionary<string, ArraySegment<byte>>();
  public readonly Manifest Manifest;

  /// Opens a package, and checks the digest of each of its files.
  public VolumePackage(byte[] zip) {
    data = zip;
    try {
      ReadDirectory();
    } catch (Exception error) when (error is ArgumentException || error is OverflowException) {
      throw new PackageException("VP4002", "the zip is damaged: " + error.Message);
    }
    ArraySegment<byte> text;
    if (!files.TryGetValue("manifest.json", out text) || text.Count > MostManifestBytes)
      throw new PackageException("VP4002", "it has no manifest.json of at most 4 MiB");
    try {
      Manifest = (Manifest)Records.Made(typeof(Manifest), new Json(Encoding.UTF8.GetString(data, text.Offset, text.Count)).Parse());
    } catch (Exception error) when (error is FormatException || error is InvalidCastException || error is OverflowException) {
      throw new PackageException("VP4004", "manifest.json: " + error.Message);
    }
    if (Manifest.format != "volpkg" || Manifest.version == null || !Manifest.version.StartsWith("1.", StringComparison.Ordinal))
      throw new PackageException("VP4003", "it is not a volume package of version 1");
    if (Manifest.state != "sealed") throw new PackageException("VP4005", "it is a draft");
    if (Manifest.extensions_required != null && Manifest.extensions_required.Length > 0)
      throw new PackageException("VP4070", "it requires an extension that this reader does not know");
    foreach (var file in Manifest.files) Check(file);
  }

  /// Bytes of a file, in place.
  public ArraySegment<byte> File(string path) {
    ArraySegment<byte> found;
    if (!files.TryGetValue(path, out found)) throw new PackageException("VP4014", "it has no file " + path);
    return found;
  }

  /// Texels of a texture, in place, for Texture3D.SetPixelData or Texture2D.LoadRawTextureData.
  public ArraySegment<byte> Texels(Texture texture) {
    var file = File(texture.file);
    if (texture.format == "palette8-rgba8unorm") return file;
    var level = 80 + 24 * (int)(texture.mipmap ?? 0);
    if (level + 24 > file.Count || file.Array[file.Offset + 44] != 0)
      throw new PackageException("VP4030", texture.file + ": no such mipmap, or it is compressed for transport");
    var offset = BitConverter.ToUInt64(data, file.Offset + level);
    var length = BitConverter.ToUInt64(data, file.Offset + level + 8);
    if (offset > (ulong)file.Count || length > (ulong)file.Count - offset)
      throw new PackageException("VP4030", texture.file + ": texels reach beyond the file");
    return new ArraySegment<byte>(data, file.Offset + (int)offset, (int)length);
  }

  /// The drawing of a picture at a level; the default picture, and the finest level, for null.
  public Drawing Draw(string picture = null, long? level = null, long frame = 0) {
    foreach (var one in Manifest.pictures)
      if (picture == null || one.name == picture)
        foreach (var drawing in one.drawings)
          if ((level == null || drawing.level == level) && (drawing.frame ?? 0) == frame) return drawing;
    throw new PackageException("VP5018", "the package has no such drawing");
  }

  void Check(FileRecord file) {
    var bytes = File(file.path);
    if (bytes.Count != file.size_bytes) throw new PackageException("VP4008", file.path + " has another size than the manifest says");
    using (var sha = SHA256.Create()) {
      var digest = BitConverter.ToString(sha.ComputeHash(bytes.Array, bytes.Offset, bytes.Count)).Replace("-", "").ToLowerInvariant();
      if (digest != file.sha256) throw new PackageException("VP4009", file.path + " is not the file that the manifest names");
    }
  }

  uint Crc(int first, int size) {
    var crc = 0xffffffffu;
    for (var i = first; i < first + size; i++) {
      crc ^= data[i];
      for (var bit = 0; bit < 8; bit++) crc = (crc >> 1) ^ (0xedb88320u & (uint)-(int)(crc & 1));
    }
    return ~crc;
  }

  uint Word(long at) { return BitConverter.ToUInt32(data, checked((int)at)); }
  int Half(long at) { return BitConverter.ToUInt16(data, checked((int)at)); }

  // Stored files with equal names and sizes in the directory and at their place; nothing behind the end record.
  void ReadDirectory() {
    var end = data.Length - 22;
    if (end < 0 || Word(end) != 0x06054b50) throw new PackageException("VP4002", "it does not end as a zip without a comment");
    long at = Word(end + 16);
    for (var left = Half(end + 10); left > 0; left--) {
      long name = Half(at + 28), size = Word(at + 24), place = Word(at + 42);
      var path = Encoding.ASCII.GetString(data, (int)at + 46, (int)name);
      var stored = Word(at) == 0x02014b50 && Half(at + 10) == 0 && Word(at + 20) == size && Word(place) == 0x04034b50;
      var local = Encoding.ASCII.GetString(data, (int)place + 30, Half(place + 26));
      long first = place + 30 + Half(place + 26) + Half(place + 28);
      if (!stored || local != path || first + size > end || files.ContainsKey(path))
        throw new PackageException("VP4002", "an entry of the zip is packed, repeated or damaged");
      // The manifest has digests of all other files.
      if (path == "manifest.json" && Crc((int)first, (int)size) != Word(at + 16))
        throw new PackageException("VP4061", "manifest.json is damaged: its CRC-32 is not the one in the zip");
      files[path] = new ArraySegment<byte>(data, (int)first, (int)size);
      at += 46 + name + Half(at + 30) + Half(at + 32);
    }
    if (at != end) throw new PackageException("VP4002", "the directory of the zip does not end where its end record begins");
  }
}

/// Fills records from parsed JSON. Keys that a record does not have are ignored.
static class Records {
  public static object Made(Type type, object value) {
    type = Nullable.GetUnderlyingType(type) ?? type;
    if (value == null || type == typeof(object)) return value;
    if (type == typeof(long)) return checked((long)(double)value);
    if (!type.IsArray && type.Namespace != typeof(Records).Namespace) return Convert.ChangeType(value, type, CultureInfo.InvariantCulture);
    if (type.IsArray) {
      var list = (List<object>)value;
      var made = Array.CreateInstance(type.GetElementType(), list.Count);
      for (var i = 0; i < list.Count; i++) made.SetValue(Made(type.GetElementType(), list[i]), i);
      return made;
    }
    var record = Activator.CreateInstance(type);
    foreach (var entry in (Dictionary<string, object>)value) {
      var field = type.GetField(entry.Key, BindingFlags.Public | BindingFlags.Instance);
      if (field != null && entry.Value != null) field.SetValue(record, Made(field.FieldType, entry.Value));
    }
    return record;
  }
}

/// Parses JSON into dictionaries, lists, texts, doubles and truth values. Raises FormatException.
sealed class Json {
  const int MostDepth = 32;
  readonly string text;
  int at;
  public Json(string text) { this.text = text; }

  public object Parse() {
    var found = Value(0);
    if (Next() != '\0') throw Wrong();
    return found;
  }

  FormatException Wrong() { return new FormatException("not JSON at character " + at); }

  char Next() {
    while (at < text.Length && " \t\r\n".IndexOf(text[at]) >= 0) at++;
    return at < text.Length ? text[at] : '\0';
  }

  void Take(char wanted) {
    if (Next() != wanted) throw Wrong();
    at++;
  }

  object Value(int depth) {
    if (depth > MostDepth) throw Wrong();
    var first = Next();
    if (first == '{') return Members(depth);
    if (first == '[') return Items(depth);
    if (first == '"') return Text();
    foreach (var word in new[] { "true", "false", "null" })
      if (string.CompareOrdinal(text, at, word, 0, word.Length) == 0) {
        at += word.Length;
        return word == "null" ? null : (object)(word == "true");
      }
    var start = at;
    while (at < text.Length && "+-.0123456789eE".IndexOf(text[at]) >= 0) at++;
    return double.Parse(text.Substring(start, at - start), NumberStyles.Float, CultureInfo.InvariantCulture);
  }

  Dictionary<string, object> Members(int depth) {
    var found = new Dictionary<string, object>();
    for (Take('{'); Next() != '}';) {
      if (found.Count > 0) Take(',');
      Next();
      var key = Text();
      Take(':');
      if (found.ContainsKey(key)) throw Wrong();
      found[key] = Value(depth + 1);
    }
    at++;
    return found;
  }

  List<object> Items(int depth) {
    var found = new List<object>();
    for (Take('['); Next() != ']';) {
      if (found.Count > 0) Take(',');
      found.Add(Value(depth + 1));
    }
    at++;
    return found;
  }

  string Text() {
    var made = new StringBuilder();
    for (Take('"'); at < text.Length && text[at] != '"'; at++) {
      if (text[at] < ' ') throw Wrong();
      if (text[at] != '\\') {
        made.Append(text[at]);
        continue;
      }
      if (++at + 1 >= text.Length) throw Wrong();
      var plain = "\"\\/bfnrt".IndexOf(text[at]);
      if (plain >= 0) made.Append("\"\\/\b\f\n\r\t"[plain]);
      else if (text[at] == 'u' && at + 4 < text.Length) {
        made.Append((char)ushort.Parse(text.Substring(at + 1, 4), NumberStyles.AllowHexSpecifier, CultureInfo.InvariantCulture));
        at += 4;
      } else throw Wrong();
    }
    if (at >= text.Length) throw Wrong();
    at++;
    return made.ToString();
  }
}

}
