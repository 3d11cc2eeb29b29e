/**
 * The parts of the manifest that this reader uses. spec/fields.md documents each field.
 *
 * @typedef {[number, number, number]} Three
 * @typedef {{shape_zyx: Three, spacing_mm_zyx: Three, origin_mm_xyz: Three, direction: [Three, Three, Three], extent_mm_zyx: Three}} Grid
 * @typedef {{path: string, role: string, size_bytes: number, sha256: string}} FileRecord
 * @typedef {{value: number, colour: Three, extinction_per_mm: number}} TransferPoint
 * @typedef {{name: string, points: TransferPoint[], reference_mm?: number, isovalue?: number}} TransferFunction
 * @typedef {{index: number, factors_zyx: Three, grid: Grid, filter: string}} Level
 * @typedef {{bits: number, window: [number, number]}} Quantization
 * @typedef {{name: string, quantization: Quantization, levels: Level[], transfer_functions: TransferFunction[]}} Channel
 * How WebGL takes a texture, which this reader adds.
 * @typedef {{target: "TEXTURE_2D" | "TEXTURE_3D", internal_format: string, format?: string, type?: string}} GlFormat
 * @typedef {{order?: string, slices_per_texel: number, textures?: number, components_per_voxel?: number, tile_shape_yx: [number, number], slices: number, gutter?: number, padding_yx?: [number, number], tiles_x: number, tiles_y: number, texture_shape_yx: [number, number]}} Mosaic
 * @typedef {{name: string, role: string, file: string, shape_zyx: Three, format: string, dimension: "2d" | "3d", gl: GlFormat, filter?: "linear" | "nearest", level?: number, channels?: string[], transfer?: string, part?: number, mipmap?: number, mosaic?: Mosaic, max_extinction_per_mm?: number, light?: StoredLight}} Texture
 * @typedef {{channels?: "luminance" | "rgb", turnable?: boolean, sky?: Three, ground?: Three, suns?: {direction: Three, colour?: Three}[], radius_mm?: number}} LightModel
 * @typedef {{normal: Three, constant_mm: number}} ClipPlane
 * @typedef {{model: LightModel, largest: number, subtracted?: number, first_colour?: Three, planes?: ClipPlane[]}} StoredLight
 * @typedef {{name: string, type: "f32" | "vec3f" | "mat4x4f", source: string}} Uniform
 * @typedef {"triangle" | "front-faces" | "back-faces" | "mesh" | "axis-slices" | "view-slices" | "half-angle-slices"} Geometry
 * @typedef {"ZERO" | "ONE" | "ONE_MINUS_SRC_ALPHA" | "ONE_MINUS_DST_ALPHA"} BlendFactor
 * @typedef {{order: "front-to-back" | "back-to-front", colour: [BlendFactor, BlendFactor], alpha: [BlendFactor, BlendFactor]}} Blend
 * @typedef {{vertex: string, fragment: string, geometry: Geometry, sampler: string, target: "rgba8" | "rgba16f" | "rgba32f", uniforms: Uniform[], reads?: string[], size?: number}} Pass
 * @typedef {Pass & {size: number, blend: Blend, behind: Blend}} LightPass
 * @typedef {object} Program
 * @property {string} name
 * @property {"texture3d" | "mosaic" | "subvolumes" | "bricks" | "on-demand"} sampling
 * @property {string} [technique] ray-casting if absent
 * @property {string} [classification]
 * @property {string} [compositing]
 * @property {{place_mm_xyz: Three, shadows?: string}} [light]
 * @property {string} [rays]
 * @property {string} vertex
 * @property {string} fragment
 * @property {Uniform[]} uniforms
 * @property {string[]} samplers
 * @property {number} [step_mm_min]
 * @property {Geometry} [geometry] triangle if absent
 * @property {Pass[]} [before]
 * @property {LightPass} [light_pass]
 * @property {Blend} [blend]
 * @property {number} [slab_samples]
 * @typedef {{texture: string, level: number, transfer: string, kind: string, block: number, blocks_zyx: Three}} SkipTable
 * @typedef {{texture: string, level: number, block: number, blocks_zyx: Three}} BlockRanges
 * @typedef {{epsilon?: number, tables?: SkipTable[], ranges?: BlockRanges[]}} Skipping
 * @typedef {{name: string, transfer: string, level: number, file?: string, triangles?: number, draco?: boolean, box_from_mesh_mm_xyz: Three}} ProxyMesh
 * @typedef {{meshes?: ProxyMesh[]}} Proxy
 * @typedef {{level: number, file: string, reference_mm: number, channel: string}} JointHistogram
 * @typedef {{grid: string, pieces?: string[], whole?: string | null}} SubvolumeFiles
 * @typedef {{index: string, bricks: string, size: number, ghost: number, levels: {factors_zyx: Three}[], format: string, places_zyx: Three}} OnDemand
 * @typedef {{name: string, api: "es1.1" | "es2.0" | "es3.0", max_texture_bytes: number, texture_formats: string[]}} Profile
 * @typedef {{name: string, title?: string, transfer: string, tint?: Three, opacity?: number, visible?: boolean, volume_ml: number}} Segment
 * @typedef {{segments?: string[], transfer: string}} SegmentLabel
 * @typedef {{name: string, transfers: string[], outside?: number, segments: Segment[], labels: SegmentLabel[]}} Segments
 * @typedef {{rmse: number, maximum: number}} StatedFidelity
 * @typedef {{level: number, frame?: number, preview_only?: boolean, program?: string, textures: string[], values: {source: string, numbers: number[]}[], step_mm?: number, at_mesh?: {program: string, mesh: string}, cost: {upload_bytes: number, gpu_bytes: number}, fidelity?: StatedFidelity}} Drawing
 * @typedef {{name: string, media: {channel: string, transfer: string}[], mixing?: "one" | "sum" | "labels" | "colour", grid?: Grid, drawings: Drawing[], pieces?: {program: string, textures: string[], step_mm: number}, on_demand?: {program: string, textures: string[], step_mm: number} | null}} Picture
 * @typedef {object} Manifest
 * @property {string} name
 * @property {Profile} profile
 * @property {Grid} grid
 * @property {Segments} [segments]
 * @property {{projection?: "orthographic" | "perspective"}} render
 * @property {Channel[]} channels
 * @property {Texture[]} textures
 * @property {Program[]} programs
 * @property {{time_s?: number}[]} [frames]
 * @property {Picture[]} pictures
 * @property {Skipping} [skipping]
 * @property {{histograms?: JointHistogram[]}} [editing]
 * @property {SubvolumeFiles} [subvolumes]
 * @property {OnDemand | null} [on_demand]
 * @property {Proxy} [proxy]
 * @property {string} [preview]
 * @property {FileRecord[]} files
 */
export {};
